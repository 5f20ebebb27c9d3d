//! What a robot that failed to verify expands to. It never runs, since it never compiles.

/// Stands where a stub would have to give something.
pub fn stub<T>() -> T {
    panic!("this robot did not verify")
}

/// An implementation of `Robot` with nothing in it.
#[doc(hidden)]
#[macro_export]
macro_rules! __stub_robot {
    ($robot:ident, $name:literal) => {
        impl $crate::Robot for $robot {
            const NAME: &'static str = $name;
            const TOPOLOGY: &'static $crate::topology::Topology =
                &$crate::topology::Topology { links: &[], joints: &[] };
            type Options = ();
            type Topics = ();
            type Wiring = ();
            fn options() {}
            fn topics() {}
            fn wire(
                _: (),
                _: &mut (),
                _: &$crate::__private::Startup,
            ) -> ::core::result::Result<(), $crate::StartError> {
                ::core::result::Result::Ok(())
            }
            fn sources(
                _: &$crate::__private::Arc<()>,
                _: (),
                _: &$crate::__private::Startup,
            ) -> ::core::result::Result<
                ::std::vec::Vec<::std::boxed::Box<dyn $crate::__private::Source>>,
                $crate::StartError,
            > {
                ::core::result::Result::Ok(::std::vec::Vec::new())
            }
            fn wired_topics(_: &()) -> &() {
                &()
            }
            fn all_topics(_: &()) -> ::std::vec::Vec<&dyn $crate::__private::AnyTopic> {
                ::std::vec::Vec::new()
            }
            fn all_nodes(_: &()) -> ::std::vec::Vec<&dyn $crate::__private::AnyNode> {
                ::std::vec::Vec::new()
            }
        }
    };
}
