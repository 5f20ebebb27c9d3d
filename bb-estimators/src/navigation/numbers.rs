//! Tuning constants of navigation, each with its unit and its reason, no name twice.
//!
//! Sizes of buffers, indices of states and limits of rounding are defined where they are used; what a user may choose is a parameter.

// Plausibility: what no robot exceeds.

/// The largest meaningful variance of a position or velocity, m² or m²/s²: the square of 10,000 km, a quarter of the Earth's circumference, or of
/// 10,000 km/s.
pub(super) const MOST_VARIANCE: f64 = 1e14;
/// The largest meaningful variance of a rotation error, rad²: beyond a hundred turns the rotation is unknown anyway.
pub(super) const MOST_ROTATION: f64 = 4e5;
/// The largest component of a position or velocity of anything on the Earth, m or m/s: eighty diameters of it, so that no choice of the origin
/// exceeds it.
pub(super) const FARTHEST_ON_EARTH: f64 = 1e9;
/// Heights possible on or above the Earth, m: from below the deepest sea to a low orbit.
pub(super) const HEIGHTS: core::ops::RangeInclusive<f64> = -1e4..=1e6;
/// Largest distance of a filter from the origin of its frame, m. At that distance, down differs by 0.8 mrad, as much as a good
/// accelerometer's bias.
pub(super) const FARTHEST_FROM_ORIGIN: f64 = 5000.0;
/// The largest difference between two positions, in standard deviations: noise exceeds it once in a million.
pub(super) const TRACK_DEVIATIONS: f64 = 5.0;
/// A speed that few robots exceed, m/s: 540 km/h.
pub(super) const FASTEST: f64 = 150.0;
/// An acceleration that no robot keeps up from one fix to the next, m/s²: that of gravity.
pub(super) const STRONGEST: f64 = 10.0;
/// Default for the longest time between two positions that can be compared, ns: in a minute, a robot at [`FASTEST`] is 9 km away, and any two
/// agree.
pub(super) const LONGEST_TRACK_NS: i64 = 60_000_000_000;
/// The time between two positions that determine a velocity, ns. In a shorter time, the noise of fixes is as large as the way; in a longer one, a
/// car may turn into the next street.
pub(super) const TRACK_BASELINE_NS: core::ops::RangeInclusive<i64> = 500_000_000..=5_000_000_000;
/// The number of agreeing positions that rules out coincidence: two define a straight line, and the third is on it.
pub const CONFIRMED: u32 = 3;
/// A velocity determines a course if it exceeds this many of its standard deviations: noise alone does so once in a million.
pub(super) const CLEARLY: f64 = 5.0;
/// The largest delay of fixes, s, in either direction: a longer one is no delay but a fault, and the position then is no longer nearly
/// a parabola.
pub(super) const MOST_DELAY_S: f64 = 0.5;
/// Largest possible distance from the origin, m: beyond the other side of the Earth.
pub(super) const FARTHEST_FLIGHT: f64 = 1.4e7;
/// The least variance that is accepted, m² or rad²: standard deviations range from a thousandth of a millimetre to a million kilometres.
pub(super) const LEAST_GIVEN_VARIANCE: f64 = 1e-18;
/// The largest variance that is accepted, m² or rad²: the square of a million kilometres, beyond which nothing is told.
pub(super) const MOST_GIVEN_VARIANCE: f64 = 1e18;
/// A speed above that of any aircraft, m/s: that of an orbit.
pub(super) const MOST_VELOCITY: f64 = 1e4;
/// A filter with a variance above this fraction of the largest meaningful one is lost: rounding may then break its covariance.
pub(super) const LOST: f64 = 1e-4;
/// A correction is at most this many times the largest meaningful deviation: a larger one comes from a covariance that is no covariance.
pub(super) const MOST_DEVIATIONS: f64 = 100.0;
/// Longest distance between two frames, m: a robot at [`FASTEST`] takes eleven minutes for it.
pub(super) const LONGEST_WAY: f64 = 1e5;

// The filter.

/// Time over which the force is averaged for the alignment of a start in motion, s: longer than vibration, shorter than a curve.
pub(super) const RECENT_FORCE_S: f64 = 0.5;
/// The largest deviation of the pitch of an IMU in its vehicle, rad: 5°, as of one that is mounted by eye.
pub(super) const MOST_PITCH: f64 = 0.09;
/// Time over which the acceleration is averaged, s: longer than vibration, shorter than the time between two fixes.
pub(super) const AVERAGED_FORCE_S: f64 = 0.1;
/// Standard deviation of the accelerometer's bias at a start, m/s²: that of a cheap IMU that is not calibrated, 20 mg.
pub(super) const START_ACCELEROMETER_BIAS: f64 = 0.2;
/// Standard deviation of the gyroscope's bias at a start, rad/s: that of a cheap IMU that is not calibrated, 1°/s.
pub(super) const START_GYROSCOPE_BIAS: f64 = 0.02;
/// The longest gap that is bridged at all, s: the position is unknown after a longer one.
pub(super) const LONGEST_GAP_S: f64 = 60.0;
/// Deviation of the position of a filter in the wrong place, m: it is anywhere within 10 km.
pub(super) const UNMOORED: f64 = 1e4;
/// Deviation of the velocity of a filter in the wrong place, m/s: what misled the position has misled the velocity, which the IMU keeps from
/// changing faster.
pub(super) const UNMOORED_SPEED: f64 = 5.0;
/// Deviation of the tilt of a filter in the wrong place, rad: 3°, since the accelerometer shows it in any place.
pub(super) const UNMOORED_TILT: f64 = 0.05;
/// Deviation of the heading of a filter in the wrong place, rad: 30°, the most that can still be corrected linearly.
pub(super) const UNMOORED_HEADING: f64 = 0.52;
/// Steps of an iterated correction. Three are as good as five, and two are not. What a single one gives is in
/// `book/src/explanation/navigation-filter.md`.
pub(super) const UPDATE_STEPS: usize = 3;
/// A linear correction is exact to two percent below this product of the normalised innovation squared and the variance of
/// the attitude, rad².
pub(super) const LINEAR: f64 = 1e-3;

// Copies of the filter.

/// The number of headings, and of mountings, that cover a turn: with [`TURN_DEVIATION`], each is corrected linearly, and eight do no better.
pub(super) const TURNS: u32 = 6;
/// The deviation of each of these headings and mountings, rad: half of the angle between two.
pub(super) const TURN_DEVIATION: f64 = core::f64::consts::PI / 6.0;
/// A larger deviation, rad, is an unknown heading: a filter cannot be corrected linearly from so far.
pub(super) const UNKNOWN_HEADING: f64 = 0.5;
/// The log likelihood by which a copy leads before it becomes the best: copies that are alike would take turns.
pub(super) const BETTER: f64 = 1.0;
/// A copy whose log likelihood is this much less than that of the best is dropped: 160,000 to one.
pub(super) const IMPLAUSIBLE: f64 = 12.0;
/// The log likelihood that a copy loses with a measurement that it cannot take: one may be an outlier, and with a second it is [`IMPLAUSIBLE`].
pub(super) const IMPOSSIBLE: f64 = 10.0;
/// The largest normalised innovation squared of a position, to each of whose variances [`POSITION_SLACK`] is added: ten deviations, since the
/// noise of IMU and fixes may still be found to be several times as large.
pub(super) const FAR_POSITION: f64 = 100.0;
/// Variance that is added to those of a position before [`FAR_POSITION`] is applied, m²: a receiver that states centimetres may be off by metres.
pub(super) const POSITION_SLACK: f64 = 1.0;
/// Speed beyond which a body moves, if it is also more than [`CLEARLY`] deviations, m/s: half of a walk.
pub(super) const MOVES: f64 = 0.5;
/// Deviations by which the speed of a body at rest is below [`MOVES`]: in 95 of 100 cases.
pub(super) const PROBABLY: f64 = 2.0;
/// The deviation of each of the attitudes that cover all, rad: half of the angle between two.
pub(super) const ATTITUDE_DEVIATION: f64 = core::f64::consts::FRAC_PI_4;
/// The deviation of an attitude of which nothing is known, rad: uniform over a turn.
pub(super) const UNKNOWABLE: f64 = 1.81;
/// The deviation of the velocity of a body at rest, m/s: an idling engine shakes it by as much.
pub(super) const STILL_SPEED: f64 = 0.05;
/// The largest normalised innovation squared of a body that may be at rest: of its three components, one in a thousand exceeds it.
pub(super) const MOST_STILL: f64 = 16.0;
/// A copy whose state is nearer to that of the best than this part of a deviation is the same: no measurement tells which of them is right.
pub(super) const SAME_COPY: f64 = 0.5;

// The newcomer, which takes over after a jump.

/// The longest time after which a newcomer that fits takes over, s: longer than reflections at a place that is passed, shorter than the time
/// after which a filter on the IMU alone is lost.
pub(super) const LONGEST_PROBATION_S: f64 = 20.0;
/// No robot that was right is so far, m, from where it is along any axis: about [`LONGEST_GAP_S`] at ten times [`FASTEST`].
pub(super) const FARTHEST_JUMP: f64 = 100_000.0;

// The search for the noise of the IMU.

/// The ratio of two neighbouring multiples. A factor of two would be hard to detect.
pub(super) const SEARCH_STEP: f64 = 4.0;
/// The multiples that are searched, as powers of [`SEARCH_STEP`]: no vehicle is quieter than the data sheet of its IMU.
pub(super) const SEARCH_EXPONENTS: core::ops::RangeInclusive<i32> = 0..=4;
/// The power at which the search begins: too little confidence heals, and too much locks biases in.
pub(super) const SEARCH_FIRST: i32 = 2;
/// Time constant with which leads are forgotten, s: two minutes of a drive.
pub(super) const SEARCH_MEMORY_S: f64 = 120.0;
/// The log likelihood by which a neighbour leads when the search moves to it: twenty to one.
pub(super) const SEARCH_LEAD: f64 = 3.0;
/// The shortest time between two moves, s: the lead must come from several fixes.
pub(super) const SEARCH_PAUSE_S: f64 = 3.0;
/// The largest number of starts with which the search compares: with more, they say more about each other than about the noise.
pub(super) const MOST_STARTS: usize = 2;

// Gaps of the IMU, over which motion is held.

/// The shortest window over which the error of holding is measured, s: what is shorter is no gap by default. Each other one is twice as long as
/// the one before.
pub(super) const SHORTEST_HOLD_S: f64 = 0.1;
/// The number of lengths of these windows: the longest is 12.8 s, of which [`HOLD_MEMORY_S`] holds just enough for [`HOLD_WINDOWS`].
pub(super) const HOLD_LENGTHS: usize = 8;
/// The time over which the squares of these errors are averaged, s: several manoeuvres, of which the last are like the next.
pub(super) const HOLD_MEMORY_S: f64 = 60.0;
/// The number of windows that make a mean: one or two may have been quiet by chance.
pub(super) const HOLD_WINDOWS: f64 = 3.0;
/// Factor on the mean square: over curves alone, the mean square is three times that of a whole minute of a car.
pub(super) const HOLD_RAISED: f64 = 3.0;
/// The least that a gap hides of the acceleration of a body at rest, as white noise, m²/s³: it may begin to move, by half a metre per second
/// within a second.
pub(super) const BEGINNING_MOTION: f64 = 0.25;
/// Motion that a gap may hide before anything is known of it, as white noise: 1 rad/s and 3 m/s² for about a second.
pub(super) const UNKNOWN_MOTION: [f64; 2] = [1.0, 9.0];

// Rest, found by itself.

/// The length of a window of vibration, s: a hundred samples of a slow IMU, and shorter than a stop.
pub(super) const REST_WINDOW_S: f64 = 1.0;
/// The number of windows that are remembered, in motion and at rest: the road of the last forty seconds.
pub(super) const REST_WINDOWS: usize = 40;
/// The place among the remembered windows, from the quietest, of the one that rest is compared with: a vehicle that coasts may be
/// quiet for two windows.
pub(super) const REST_PLACE: usize = 2;
/// A window in motion has at least this many times the variance of one at rest: an engine that idles has a third of it.
pub(super) const QUIETER: f64 = 2.25;
/// A window at rest has at most this many times the variance of the loudest known one: as far as that of a second is off.
pub(super) const LOUDER: f64 = 1.5;
/// The number of successive quiet windows that are rest: one more than a vehicle that coasts may be quiet for.
pub(super) const SUCCESSIVE: u32 = 3;
/// The least variance of the mean of a gyroscope, (rad/s)²: its noise is not white.
pub(super) const LEAST_RATE_VARIANCE: f64 = 1e-8;

// The scatter of fixes.

/// Error of the acceleration due to a wrong attitude, a lever arm and a bias, m/s². Only scatter beyond it counts.
pub(super) const UNMODELLED_ACCELERATION: f64 = 1.0;
/// The longest time between two fixes that are compared, s: over a longer one, [`UNMODELLED_ACCELERATION`] hides noise of [`UNSEEN_SCATTER`].
pub(super) const LONGEST_DIFFERENCE_S: f64 = 3.5;
/// Number of differences that are kept. An outlier spoils three of them, and a jump two.
pub(super) const DIFFERENCES: usize = 9;
/// Rank, from the smallest, of the difference that is taken as the variance: the largest that an outlier leaves intact, and for three axes
/// as often above the variance as below.
pub(super) const SCATTER_PLACE: usize = 5;
/// Factor within which nine differences, each of which shares two fixes with the next, determine the variance: a receiver whose stated
/// variance is not smaller by more is believed.
pub(super) const SCATTER_KNOWN: f64 = 2.0;
/// The variance of a fix that has not yet shown its own, m²: a receiver may state centimetres and scatter by metres.
pub(super) const UNSEEN_SCATTER: f64 = 9.0;
/// Ratio to the usual variance beyond which a fix gets its whole difference as its noise: three standard deviations.
pub(super) const CLEAR_SCATTER: f64 = 9.0;

// The smoother.

/// The fraction of a relinearisation threshold below which a change of correction is not propagated to earlier keyframes until they are
/// requested: a hundredth of what is worth an elimination.
pub(super) const SETTLED: f64 = 0.01;
/// A weight is replaced if the kernel's differs from it by more than this: a hundredth of the factor's deviation.
pub(super) const REWEIGHED_FACTOR: f64 = 0.02;
/// An optional state keeps at least this fraction of its value from one keyframe to the next, so that the transition
/// stays invertible.
pub(super) const LEAST_KEPT: f64 = 1e-6;
/// A landmark is relinearised if the kernel's weight of an observation differs from the current one by more than this: five times as much as for
/// a factor, since it is one of many that hold a keyframe.
pub(super) const REWEIGHED_LANDMARK: f64 = 0.1;
/// Multiple of its thresholds that a landmark must exceed to be relinearised in an update, which then eliminates the keyframes from its
/// first on once more. With its next observation, it is relinearised for less, at no such cost.
pub(super) const PRESSING: f64 = 3.0;
/// The fraction of good landmarks that are rejected because their directions do not intersect: of a hundred in each image, one in a hundred
/// images.
pub(super) const UNFIT: f64 = 1e-4;
/// A landmark that continues without a prior is given a standard deviation of this many times its distance: almost no
/// information, but never singular.
pub(super) const UNKNOWN_LANDMARK: f64 = 100.0;
/// A landmark that none of this many newest keyframes saw is lost: a tracker has given it up, and another one needs its room.
pub(super) const LANDMARK_LOST_AFTER: u64 = 5;
/// The most of its distance to within which a landmark must be known, given the keyframes, to keep its linearisation point: what is left of the
/// second order is then a hundredth.
pub(super) const LANDMARK_KNOWN_WITHIN: f64 = 0.1;
/// A landmark that is off by this many times as much begins again: three deviations of what was known.
pub(super) const LANDMARK_FAR: f64 = 3.0;
/// Gauss–Newton steps for a single landmark: from a guess that is right within a half, each doubles the digits.
pub(super) const TRIANGULATION_STEPS: usize = 5;
/// Newton steps before a pixel is rejected as one that the lens cannot produce: several times what any other pixel needs.
pub(super) const PIXEL_STEPS: usize = 30;
/// The least deviation of an observation, pixels, and of a prior position, m. Below it, the rounding errors of one observation
/// exceed all that others tell.
pub(super) const LEAST_SIGHT_DEVIATION: f64 = 1e-3;

// Flights.

/// Largest difference of two stamps that agree, ns: that of an IMU that was silent for a moment.
pub(super) const AGREED_NS: i64 = 1_000_000_000;
/// A clock jump is believed once agreeing stamps have covered this time, ns, and none has come from the former clock: longer than a burst that
/// was corrupted or delayed.
pub(super) const BELIEVED_NS: i64 = 500_000_000;
/// Minimum number of agreeing stamps by which a clock jump is believed: of a slow IMU, two in [`BELIEVED_NS`] might be corrupt alike.
pub(super) const BELIEVED_STAMPS: u32 = 5;
/// Largest lag of the caller's clock behind the IMU's, ns: as far as estimates are predicted by default.
pub(super) const LONGEST_LAG_NS: i64 = 200_000_000;
/// Shortest time between two copies of the engine, ns: a copy costs as much as some samples, and closer ones more than they save.
pub(super) const COPY_INTERVAL_NS: i64 = 100_000_000;
/// Longest time by which the engine may be behind the IMU, ns: runs stay short, and an output at 5 Hz finds most of them done.
pub(super) const LONGEST_TAIL_NS: i64 = 250_000_000;
/// Time beyond the interval of keyframes for which one may wait for a slow camera, ns. The room for inputs includes this margin.
pub(super) const CAMERA_SLACK_NS: i64 = 1_000_000_000;
/// Time for which an estimate is distrusted after it has moved, or after an input that does not fit, ns: until the next fix of a receiver at 1 Hz
/// shows whether it was right.
pub(super) const DISTRUST_NS: i64 = 1_000_000_000;
/// Number of consecutive positions that must fit before an estimate is trusted again after positions overruled it: a second of a receiver at 5
/// Hz, whose errors last.
pub(super) const CONFIRMATIONS: u32 = 5;
/// Normalised innovation squared over the dimension up to which a position fits: three of a hundred right ones exceed it.
pub(super) const FITS: f64 = 3.0;
/// Number of consecutive refusals of one sensor that are more than outliers: these come alone or in pairs.
pub(super) const STORM: u64 = 3;
/// Number of consecutive refused positions that are more than outliers. Positions arrive about once a second.
pub(super) const POSITION_STORM: u64 = 2;
/// Normalised innovation squared over the dimension at which a single position makes the estimate doubtful: thirty standard
/// deviations.
pub(super) const DOUBTFUL_POSITION: f64 = 1000.0;
/// Time without a camera or an anchor after which a trusted receiver may overrule the estimate, ns: the IMU alone is less certain.
pub(super) const ALONE_NS: i64 = 60_000_000_000;
/// Maximum age of an attitude at the start, s: until then, a vehicle at take-off has hardly turned.
pub(super) const ATTITUDE_AGE_S: f64 = 1.0;
/// Standard deviation of each velocity component after a start from an anchor in the air, m/s: the speed of a fast drone.
pub(super) const UNKNOWN_VELOCITY: f64 = 30.0;
/// A bias is rejected if it exceeds this many of its standard deviations: a right one does so once in a million.
pub(super) const PLAUSIBLE_BIAS: f64 = 5.0;
/// Standard deviation of a fix that does not report its own, m: of a receiver under an open sky. For its height, which satellites from above show
/// less, twice that is used.
pub(super) const UNSTATED_FIX: f64 = 5.0;
/// Gain per output of the filter for the steady norm of the covariance: four seconds at the default of 5 Hz, and longer than a cycle of anchors.
pub(super) const STEADY_GAIN: f64 = 0.05;
/// A warning is re-armed once the norm is below this fraction of its limit: a norm about the limit is told once.
pub(super) const REARMED: f64 = 0.75;

// Declared filters.

/// After this many rejected IMU samples in a row, there is no estimate: a quarter of a second at 200 Hz, in which it has not moved far.
pub(super) const MOST_REFUSED: u32 = 50;
/// Largest lead of a measurement's stamp over the IMU, ns: as far as samples are delayed on their way at most.
pub(super) const LONGEST_LEAD_NS: i64 = 500_000_000;
/// Standard deviation of the height where a fix has none, m: anything from a valley to an aircraft.
pub(super) const UNKNOWN_HEIGHT: f64 = 1e4;
/// The time of a start, ns, after which it is reported, and waits no longer for an input that may be missing or slow: ten fixes at 1 Hz.
pub(super) const LONGEST_START_NS: i64 = 10_000_000_000;
/// The time for which the filter waits for rest once it knows where it is, ns: a body at rest has rested for long enough by then.
pub(super) const RESTLESS_NS: i64 = 3_000_000_000;
/// Standard deviation of the world's origin without satellites, m: it is known by definition.
pub(super) const ORIGIN_DEVIATION: f64 = 0.01;
/// The largest standard deviation of a heading that nothing measures, rad: the world is turned so that it is right.
pub(super) const HEADING_BY_DEFINITION: f64 = 0.1;
/// Standard deviation of the velocity of a robot in motion, m/s: what a car changes it by in the seconds over which fixes show the mean.
pub(super) const MOVING: f64 = 5.0;
/// The longest time that a given state is moved on, s: after that it is too uncertain to start from.
pub(super) const LONGEST_MOVE_S: f64 = 20.0;
/// Standard deviation of the rotation of a pose that states none, rad for each metre of that of its position: a detector of markers at a distance
/// of ten metres.
pub(super) const TURNED_PER_METRE: f64 = 0.1;
/// The acceleration of a robot whose state is given, as white noise, m/s²/√Hz: of a rover that changes its speed by 1 m/s within a second.
pub(super) const START_ACCELERATION: f64 = 1.0;
/// Number of agreeing fixes that may define a world. With a receiver at 1 Hz, a robot often cannot wait for more.
pub(super) const COURSES_AGREED: u32 = 2;
/// Standard deviation of the initial velocity if no sensor reports it, m/s: a rover's speed.
pub(super) const PLANAR_START_SPEED: f64 = 1.0;
/// Share of its speed by which a robot may differ from what its wheels report at the start, and the same in m/s at rest: ten percent, of slip and
/// an unknown radius.
pub(super) const START_SLIP: f64 = 0.1;
/// The largest angle between the z axes of a planar sensor and the link, as a cosine: 2.6°, by which rates about z are off by a thousandth.
pub(super) const UPRIGHT: f64 = 0.999;
/// Variance of the components that the plane determines, m², rad² and their squares per second: height, roll and pitch. Not 0, so
/// that the covariance can be inverted.
pub(super) const PLANE_VARIANCE: f64 = 1e-6;
