//! The `robot!` macro and the derives of `bb-core`, which re-exports them: use them from there.
//!
//! A robot goes through four phases, each in the folder of its name:
//!
//! 1. [`parse`]: tokens to a tree. Never fails: what it cannot read it reports and skips.
//! 2. [`model`]: the tree to plain data in which paths are resolved to what they name.
//! 3. [`verify`]: the rules of the language, one a file. Gives a [`verify::Verified`] only if all hold.
//! 4. [`expand`]: a verified robot to its wiring; one that failed to stubs, so that one mistake gives one message.

use proc_macro::TokenStream;

mod derive;
mod diagnostics;
mod expand;
mod model;
mod names;
mod parse;
mod units;
mod verify;

#[cfg(test)]
mod tests;

/// Declares a robot: its links, joints, sensors and estimators.
///
/// It stands at module level and defines the robot's type and, under its name in snake case, a module with a typed
/// handle for every publisher, at its path: `rover::sensor::base_link::imu`.
///
/// ```
/// use bb_core::prelude::*;
///
/// # #[derive(Debug)] pub struct Still;
/// # impl Sensor for Still {
/// #     type Options = NoOptions;
/// #     type Output = Imu;
/// #     fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> { Ok(Self) }
/// #     fn read(&mut self, _: MonotonicTime) -> Result<Reading<Imu>, Fault> {
/// #         Ok(Reading::now(Imu::new(Default::default(), [0.0, 0.0, 9.81].into())))
/// #     }
/// # }
/// robot! {
///     /// A mast that turns.
///     robot Mast;
///
///     link base {
///         joint turn: revolute {
///             origin: { xyz: [0 m, 0 m, 0.9 m], rpy: [0 deg, 0 deg, 45 deg] };
///             axis: z;
///             limit: { lower: -90 deg, upper: 90 deg, velocity: 60 deg/s, effort: 5 N*m };
///             link head {
///                 sensor imu: Still() { rate: 100 Hz; }
///             }
///         }
///     }
/// }
///
/// fn main() -> Result<(), StartError> {
///     let builder = Mast::builder();
///     let imu = builder.subscribe(mast::sensor::base::turn::head::imu);
///     let mut simulation = builder.simulate()?;
///     simulation.run_for(Duration::from_secs(1));
///     assert_eq!(imu.drain().count(), 101);
///     Ok(())
/// }
/// ```
///
/// # Language
///
/// | construct | where | meaning |
/// |---|---|---|
/// | `robot Name;` | first | the type to define; may be preceded by `pub` and documented |
/// | `sensors { … }` | robot | sensors of the robot as a whole, in no frame |
/// | `link name { … }` | robot (one: the root), joint (one) | a rigid body with its frame |
/// | `joint name: kind { … }` | link | `fixed`, `revolute`, `continuous`, `prismatic`, `planar` or `floating` |
/// | `origin: { xyz: […], rpy: […] };` | joint | where the joint stands in its parent link: lengths, and angles about the fixed axes x, y, z |
/// | `axis: z;` | joint | `x`, `y`, `z`, `-x`, `-y`, `-z` or `[a, b, c]`; for `planar` the plane's normal |
/// | `limit: { lower: …, upper: …, velocity: …, effort: … };` | joint | angles where it turns, lengths where it slides |
/// | `sensor name: Type(option = value, …) { … }` | link, joint, `sensors` | a [`Sensor`](trait@Sensor) |
/// | `rate: 200 Hz;` | sensor | how often it is read |
/// | `estimator name: Type(option = value, …) { … }` | sensor, link | an [`Estimator`](trait@Estimator) |
/// | `input name: path, driver, optional, within: 20 ms;` | estimator of a link | what it takes; `driver` marks the one whose arrival dispatches |
/// | `output name;` or `output name: [path, …];` | estimator | which outputs are published, and where |
/// | `sync_tolerance: 20 ms;` | estimator of several inputs | how much older than the driver the others may be |
///
/// Numbers carry units: `20 ms`, `-90 deg`, `9.81 m/s^2`, `5 N*m`, also glued, `20ms`.
#[proc_macro]
pub fn robot(tokens: TokenStream) -> TokenStream {
    pipeline(tokens.into()).into()
}

/// The four phases.
fn pipeline(tokens: proc_macro2::TokenStream) -> proc_macro2::TokenStream {
    let mut diagnostics = diagnostics::Diagnostics::default();
    let tree = parse::robot(tokens, &mut diagnostics);
    let robot = model::resolve(tree);
    let expansion = match verify::verify(&robot, &mut diagnostics) {
        Some(verified) => expand::robot(&verified),
        None => expand::stub(&robot),
    };
    let errors = diagnostics.into_tokens();
    quote::quote!(#errors #expansion)
}

/// Makes a struct or an enum the payload of messages. See the trait.
#[proc_macro_derive(Payload)]
pub fn payload(tokens: TokenStream) -> TokenStream {
    derive::derive(tokens.into(), derive::payload).into()
}

/// Makes a struct the options of a component: `#[option(default = …, range = a..=b, unit = "…")]` or
/// `#[option(required)]` on each field. See the trait.
#[proc_macro_derive(Options, attributes(option))]
pub fn options(tokens: TokenStream) -> TokenStream {
    derive::derive(tokens.into(), derive::options).into()
}

/// Makes a struct of `Input<'a, …>` and `Option<Input<'a, …>>` fields the input of an estimator. See the trait.
#[proc_macro_derive(Inputs)]
pub fn inputs(tokens: TokenStream) -> TokenStream {
    derive::derive(tokens.into(), derive::inputs).into()
}

/// Makes a struct of `Option<…>` fields the output of an estimator. See the trait.
#[proc_macro_derive(Outputs)]
pub fn outputs(tokens: TokenStream) -> TokenStream {
    derive::derive(tokens.into(), derive::outputs).into()
}
