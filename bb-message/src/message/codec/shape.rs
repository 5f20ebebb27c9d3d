//! The meaning of a type's bytes, as constant data.

use std::fmt;

/// The meaning of a type's bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// One byte, 0 or 1.
    Bool,
    /// A Unicode scalar value, four bytes.
    Char,
    /// A signed integer.
    I8,
    /// A signed integer.
    I16,
    /// A signed integer.
    I32,
    /// A signed integer.
    I64,
    /// An unsigned integer.
    U8,
    /// Eight bits that ROS calls `byte`, and tells from an unsigned integer.
    Byte,
    /// An unsigned integer.
    U16,
    /// An unsigned integer.
    U32,
    /// An unsigned integer.
    U64,
    /// IEEE 754, four bytes.
    F32,
    /// IEEE 754, eight bytes.
    F64,
    /// UTF-8.
    Text,
    /// A list of at most one.
    Option(&'static Shape),
    /// A length and that many values.
    List(&'static Shape),
    /// A fixed number of values, at least one.
    Array(&'static Shape, usize),
    /// Fields one after the other.
    Struct(&'static StructShape),
    /// The number of the variant as `u32`; then, for each variant with fields, a list of at most one.
    Enum(&'static EnumShape),
}

impl Shape {
    /// Returns whether it is a number, or an option of one.
    pub(super) const fn is_number(self) -> bool {
        match self {
            Self::I8 | Self::I16 | Self::I32 | Self::I64 => true,
            Self::U8 | Self::Byte | Self::U16 | Self::U32 | Self::U64 => true,
            Self::F32 | Self::F64 => true,
            Self::Option(of) => of.is_number(),
            _ => false,
        }
    }
}

/// Shape of a struct, see [`Shape::Struct`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StructShape {
    /// `Imu`; for a ROS message, with its package: `sensor_msgs/Imu`.
    pub name: &'static str,
    /// Fields in the order of the bytes.
    pub fields: &'static [FieldShape],
}

/// A field of a struct.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FieldShape {
    /// Name; the number of an unnamed field.
    pub name: &'static str,
    /// Shape of the value: the meaning of its bytes.
    pub shape: Shape,
    /// The unit of its numbers, if the field states one: `#[payload(unit = "V")]`. Several if that depends, as for the
    /// position of a joint: rad or m.
    pub units: &'static [FieldUnit],
    /// The numbers that it may hold, if the field states them: `#[payload(range = 0.0..=1.0)]`, in the unit of the field. What is read from
    /// JSON is checked; code may hold others.
    pub range: Option<FieldRange>,
    /// Doc comment, for forms; empty for none.
    pub doc: &'static str,
}

/// The range of a field's number, both ends included.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct FieldRange {
    /// Bits of the number, so that shapes can be compared.
    minimum: u64,
    maximum: u64,
}

impl FieldRange {
    /// The smallest number.
    pub const fn minimum(self) -> f64 {
        f64::from_bits(self.minimum)
    }

    /// The largest number.
    pub const fn maximum(self) -> f64 {
        f64::from_bits(self.maximum)
    }
}

impl fmt::Debug for FieldRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}..={:?}", self.minimum(), self.maximum())
    }
}

/// The unit of a field's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FieldUnit {
    /// Exponents of metre, kilogram, second, ampere, kelvin and radian.
    pub exponents: [i8; 6],
    /// The dimension with its article: "a voltage".
    pub dimension: &'static str,
    /// Symbol of the unit: `V`.
    pub symbol: &'static str,
}

/// Shape of an enum, see [`Shape::Enum`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EnumShape {
    /// `Safety`
    pub name: &'static str,
    /// Variants by number.
    pub variants: &'static [StructShape],
}

/// The only field of a struct without fields, as in ROS.
pub(super) const NOTHING: &str = "structure_needs_at_least_one_member";

impl FieldShape {
    /// A field.
    pub const fn new(name: &'static str, shape: Shape) -> Self {
        Self { name, shape, units: &[], range: None, doc: "" }
    }

    /// Sets the units that a field may have.
    pub const fn in_units(mut self, units: &'static [FieldUnit]) -> Self {
        self.units = units;
        self
    }

    /// Sets the numbers that a field may hold.
    pub const fn in_range(mut self, minimum: f64, maximum: f64) -> Self {
        assert!(self.shape.is_number(), "only a number, or an `Option` of one, has a range");
        assert!(minimum <= maximum, "the range is empty");
        self.range = Some(FieldRange { minimum: minimum.to_bits(), maximum: maximum.to_bits() });
        self
    }

    /// Sets the doc comment of a field.
    pub const fn documented(mut self, doc: &'static str) -> Self {
        self.doc = doc;
        self
    }

    /// Returns whether it is a field, not what a struct without fields holds.
    #[doc(hidden)]
    pub fn is_named(&self) -> bool {
        self.name != NOTHING
    }

    /// The content of a struct without fields.
    #[doc(hidden)]
    pub const NOTHING: Self = Self::new(NOTHING, Shape::U8);
}
