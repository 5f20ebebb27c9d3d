//! Tests of whole robots; see the test targets of this crate. The code in the documents is compiled here.

pub mod law;
pub mod random;
pub mod recordings;

/// Documents whose code is compiled, and run unless it says `no_run`.
macro_rules! compiled {
    ($($name:ident: $path:literal,)*) => {$(
        #[cfg(doctest)]
        #[doc = include_str!(concat!("../../", $path))]
        struct $name;
    )*};
}

// A test of the architecture checks that each page of the book with code is here.
compiled! {
    Readme: "README.md",
    Navigation: "book/src/how-to/navigation.md",
    Mavlink: "book/src/how-to/mavlink.md",
    TutorialAttitude: "book/src/tutorial/1-attitude.md",
}
