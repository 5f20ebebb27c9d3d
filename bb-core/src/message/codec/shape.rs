//! What the bytes of a type mean, as constant data.

/// What the bytes of a type mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// One byte, 0 or 1.
    Bool,
    /// A Unicode scalar value, four bytes.
    Char,
    /// An integer with a sign.
    I8,
    /// An integer with a sign.
    I16,
    /// An integer with a sign.
    I32,
    /// An integer with a sign.
    I64,
    /// An integer.
    U8,
    /// An integer.
    U16,
    /// An integer.
    U32,
    /// An integer.
    U64,
    /// IEEE 754, four bytes.
    F32,
    /// IEEE 754, eight bytes.
    F64,
    /// UTF-8.
    Text,
    /// A list of none or one.
    Option(&'static Shape),
    /// A length and so many.
    List(&'static Shape),
    /// So many; at least one.
    Array(&'static Shape, usize),
    /// Fields one after the other.
    Struct(&'static StructShape),
    /// The number of the variant as `u32`; then for each variant with fields a list of none or one of them.
    Enum(&'static EnumShape),
}

/// See [`Shape::Struct`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StructShape {
    /// `Imu`; that of a ROS message with its package: `sensor_msgs/Imu`.
    pub name: &'static str,
    /// In the order of the bytes.
    pub fields: &'static [FieldShape],
}

/// A field of a struct.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FieldShape {
    /// Its name; that of a field without a name is its number.
    pub name: &'static str,
    /// What its bytes mean.
    pub shape: Shape,
}

/// See [`Shape::Enum`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EnumShape {
    /// `Safety`
    pub name: &'static str,
    /// By number.
    pub variants: &'static [StructShape],
}

/// The only field of a struct without fields, as in ROS.
pub(super) const NOTHING: &str = "structure_needs_at_least_one_member";

impl FieldShape {
    /// A field.
    pub const fn new(name: &'static str, shape: Shape) -> Self {
        Self { name, shape }
    }

    /// What a struct without fields holds.
    #[doc(hidden)]
    pub const NOTHING: Self = Self { name: NOTHING, shape: Shape::U8 };
}
