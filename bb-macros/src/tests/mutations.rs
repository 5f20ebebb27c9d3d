//! Tests with mutated robots: for any tokens, the macro does not panic, returns tokens that parse, and points at what was written.

use super::expansion::{ACTING, WHOLE};
use super::{diagnostics, tokens};
use crate::pipeline;
use proc_macro2::{Delimiter, Group, Span, TokenStream, TokenTree};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Tokens inserted where they do not belong.
const STRAY: &str = r#"
    robot link joint sensor sensors estimator input output rate sync_tolerance origin axis limit driver optional
    within fixed revolute continuous prismatic planar floating xyz rpy lower upper velocity effort x z imu base
    parameters states commands category controllers bridges actuator concurrency allowed_states timeout cancel all
    default motion runs_on worker priority core lost_after on_lost recover_after param range f64 i64 String bool Rover rover r#type type self Self super crate match _ out nav 'a
    0 1 -1 0.5 1e308 1e999 0x1F 0b1 20ms 90deg 1e308km 5_000 1u8 2f32 340282366920938463463374607431768211456
    m s ms deg Hz kg km hz "text" 'c' b"bytes" true
    : ; , . = == => :: < > - + * / ^ & # ! ? $ @ | .. ..=
"#;

const SMALL: [&str; 2] = [
    "robot A; link b { sensor i: S(x = 1) { rate: 1 Hz; } estimator t: T() { input i: sensor::b::i; output out; } }",
    "robot B; link b { joint j: revolute { axis: [0, 1, 0]; limit: { lower: 0 deg, upper: 1 km^9*km^9/s^2 }; link c; } }",
];

struct Random(ChaCha8Rng);

impl Random {
    fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    fn below(&mut self, end: usize) -> usize {
        (self.0.next_u64() % end.max(1) as u64) as usize
    }

    fn delimiter(&mut self) -> Delimiter {
        [Delimiter::Brace, Delimiter::Parenthesis, Delimiter::Bracket, Delimiter::None][self.below(4)]
    }

    /// A stray token, or occasionally a group of them.
    fn tree(&mut self, stray: &[TokenTree], depth: usize) -> TokenTree {
        if depth > 0 && self.below(5) == 0 {
            let count = self.below(8);
            let inner = (0..count).map(|_| self.tree(stray, depth - 1)).collect();
            return Group::new(self.delimiter(), inner).into();
        }
        stray[self.below(stray.len())].clone()
    }

    /// Deletes, doubles, swaps or replaces a token somewhere.
    fn mutate(&mut self, stream: TokenStream, stray: &[TokenTree]) -> TokenStream {
        let mut trees: Vec<TokenTree> = stream.into_iter().collect();
        let groups: Vec<usize> = (0..trees.len()).filter(|at| matches!(trees[*at], TokenTree::Group(_))).collect();
        if !groups.is_empty() && self.below(5) > 0 {
            let at = groups[self.below(groups.len())];
            if let TokenTree::Group(group) = &trees[at] {
                trees[at] = Group::new(group.delimiter(), self.mutate(group.stream(), stray)).into();
            }
            return trees.into_iter().collect();
        }
        let (at, other) = (self.below(trees.len()), self.below(trees.len()));
        match self.below(4) {
            _ if trees.is_empty() => trees.push(self.tree(stray, 2)),
            0 => drop(trees.remove(at)),
            1 => trees.insert(at, trees[other].clone()),
            2 => trees.swap(at, other),
            _ => trees[at] = self.tree(stray, 2),
        }
        trees.into_iter().collect()
    }
}

/// Expands as the macro does; then checks the places, on tokens from one text.
fn check(stream: &TokenStream) {
    let expansion = pipeline(stream.clone());
    if let Err(error) = syn::parse2::<syn::File>(expansion) {
        panic!("{error} in the expansion of {stream}");
    }
    let text = stream.to_string();
    let Ok(stream) = text.parse::<TokenStream>() else {
        return;
    };
    let is_empty = stream.is_empty();
    for fault in diagnostics(stream) {
        let under = [fault.place.start, fault.place.end].map(|span: Span| span.byte_range());
        let inside = under.iter().all(|range| !range.is_empty() && range.end <= text.len());
        assert!(is_empty || (inside && under[0].start <= under[1].start), "{fault:?} is not in {text}");
    }
}

/// Checks a robot after one to four mutations, in that many rounds.
fn check_mutated(robot: &str, rounds: u64) {
    let stray: Vec<TokenTree> = tokens(STRAY).into_iter().collect();
    let robot = tokens(robot);
    for seed in 0..rounds {
        let mut random = Random::new(seed);
        let mut robot = robot.clone();
        for _ in 0..=random.below(4) {
            robot = random.mutate(robot, &stray);
        }
        check(&robot);
    }
}

// One test each, so that they run side by side. A round of a large one takes as long as several of a small one, and meets fewer errors.

#[test]
fn mutations_of_a_whole_robot_are_no_panic() {
    check_mutated(WHOLE, 250);
}

#[test]
fn mutations_of_an_acting_robot_are_no_panic() {
    check_mutated(ACTING, 200);
}

#[test]
fn mutations_of_small_robots_are_no_panic() {
    SMALL.iter().for_each(|robot| check_mutated(robot, 2_000));
}

#[test]
fn stray_tokens_are_no_panic() {
    let stray: Vec<TokenTree> = tokens(STRAY).into_iter().collect();
    for seed in 0..2_500 {
        let mut random = Random::new(seed);
        let start = if random.below(2) == 0 { "robot Rover;" } else { "" };
        let count = random.below(30);
        let robot = tokens(start).into_iter().chain((0..count).map(|_| random.tree(&stray, 4))).collect();
        check(&robot);
    }
}
