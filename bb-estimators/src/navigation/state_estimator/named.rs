//! Enumerations whose values have names.

/// Declares such an enumeration.
macro_rules! named {
    ($(#[$about:meta])* pub enum $name:ident {
        $($(#[$of:meta])* $value:ident $({ $($fields:tt)* })? = $text:literal,)+
    }) => {
        $(#[$about])*
        pub enum $name {
            $($(#[$of])* $value $({ $($fields)* })?,)+
        }

        impl $name {
            /// The name in logs and recordings.
            pub const fn name(&self) -> &'static str {
                match self {
                    $(Self::$value { .. } => $text,)+
                }
            }
        }
    };
}
pub(super) use named;
