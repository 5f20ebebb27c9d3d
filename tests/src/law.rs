//! Laws that hold for random cases, with one copy of the test runner for all of them.

use proptest::strategy::{BoxedStrategy, Strategy};
use proptest::test_runner::{TestCaseResult, TestRunner, contextualize_config};
use std::any::Any;
use std::fmt::{self, Debug};

pub use proptest::test_runner::Config;

/// Tests, each a law with random arguments, written as in [`proptest!`](proptest::proptest).
///
/// That macro compiles the whole runner again for each law: half of the optimised code of the estimators' tests was that. Here the runner
/// knows one type of case, and calls laws through a reference.
#[macro_export]
macro_rules! laws {
    (#![proptest_config($config:expr)] $(
        $(#[$attribute:meta])*
        fn $name:ident($($argument:pat in $strategy:expr),+ $(,)?) $law:block
    )*) => {$(
        $(#[$attribute])*
        fn $name() {
            let mut config: $crate::law::Config = $config;
            config.test_name = Some(concat!(module_path!(), "::", stringify!($name)));
            config.source_file = Some(file!());
            let names = concat!($(stringify!($argument), ", "),+);
            $crate::law::check(config, names, ($($crate::law::boxed($strategy),)+), |($($argument,)+)| {
                $law
                #[allow(unreachable_code, reason = "a law may return")]
                Ok(())
            });
        }
    )*};
    ($(#[$attribute:meta])* fn $($laws:tt)*) => {
        $crate::laws! { #![proptest_config($crate::law::Config::default())] $(#[$attribute])* fn $($laws)* }
    };
}

/// Random values whose type is that of the value alone.
pub fn boxed<S: Strategy + 'static>(strategy: S) -> BoxedStrategy<S::Value> {
    strategy.boxed()
}

/// The arguments of a law, of any type.
struct Case(Box<dyn Arguments>);

trait Arguments: Any + Debug {}
impl<T: Any + Debug> Arguments for T {}

impl Debug for Case {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(formatter)
    }
}

/// Tests a law with random `cases`; a failure names its arguments.
///
/// # Panics
///
/// Panics with the smallest case that contradicts the law.
pub fn check<S, L>(config: Config, names: &str, cases: S, law: L)
where
    S: Strategy + 'static,
    S::Value: 'static,
    L: Fn(S::Value) -> TestCaseResult,
{
    let cases = cases.prop_map(|arguments| Case(Box::new(arguments))).boxed();
    run(config, names, &cases, &|case| {
        let arguments: Box<dyn Any> = case.0;
        law(*arguments.downcast().expect("cases are made of these arguments"))
    });
}

fn run(config: Config, names: &str, cases: &BoxedStrategy<Case>, law: &dyn Fn(Case) -> TestCaseResult) {
    let mut runner = TestRunner::new(contextualize_config(config));
    if let Err(error) = runner.run(cases, law) {
        panic!("{error}\narguments: {names}\n{runner}");
    }
}

#[cfg(test)]
mod tests {
    use super::Config;
    use proptest::prelude::*;

    laws! {
        // What fails here is not to be kept for the next time.
        #![proptest_config(Config { failure_persistence: None, ..Config::default() })]

        #[test]
        fn a_true_law_holds(one in 0..100_u32, (other, _) in (0..100_u32, any::<bool>())) {
            prop_assume!(one != other);
            prop_assert_ne!(one, other);
        }

        #[test]
        #[should_panic(expected = "minimal failing input: (\n    50,\n)")]
        fn a_law_that_fails_names_the_smallest_case(number in 0..100_u32) {
            prop_assert!(number < 50);
        }

        #[test]
        #[should_panic(expected = "arguments: one, other, ")]
        fn a_law_that_panics_names_its_arguments(one in 0..100_u32, other in 0..100_u32) {
            assert!(one + other < 50, "it panics");
        }
    }
}
