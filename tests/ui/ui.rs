//! Robots that must not compile: `<rule>/wrong_*.rs` with what rustc says, and `<rule>/right_*.rs` that must.

#[test]
fn robots() {
    let cases = trybuild::TestCases::new();
    cases.compile_fail("*/wrong_*.rs");
    cases.pass("*/right_*.rs");
}
