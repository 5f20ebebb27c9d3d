//! Numbers with a special meaning in ROS: unknown quantities, and enums.

/// A variance. ROS writes an unknown one as zero.
pub(super) fn unless_zero<T: Default + PartialEq>(variance: T) -> Option<T> {
    (variance != T::default()).then_some(variance)
}

/// ROS writes NaN for values that are not measured.
pub(super) fn or_nan(value: Option<f64>) -> f32 {
    value.map_or(f32::NAN, |value| value as f32)
}

/// ROS writes NaN for values that are not measured.
pub(super) fn unless_nan(value: f64) -> Option<f64> {
    (!value.is_nan()).then_some(value)
}

/// The number of a value: its index in `all`.
pub(super) fn code<T: PartialEq>(all: &[T], value: T) -> u8 {
    let index = all.iter().position(|other| *other == value).unwrap_or_default();
    u8::try_from(index).unwrap_or_default()
}

/// The value with a number; for a number that a later ROS may have added, the default, which means unknown.
pub(super) fn of_code<T: Copy + Default>(all: &[T], code: u8) -> T {
    all.get(usize::from(code)).copied().unwrap_or_default()
}
