//! Chain in Copper, without its log.

use crate::Inertial;
use cu29::prelude::*;
use std::hint::black_box;
use std::sync::atomic::{AtomicU64, Ordering};

/// Number of messages that the sink has taken.
static RECEIVED: AtomicU64 = AtomicU64::new(0);

#[derive(Reflect)]
struct Source;

impl Freezable for Source {}

impl CuSrcTask for Source {
    type Resources<'r> = ();
    type Output<'m> = output_msg!(Inertial);

    fn new(_: Option<&ComponentConfig>, _: Self::Resources<'_>) -> CuResult<Self> {
        Ok(Self)
    }

    fn process(&mut self, context: &CuContext, output: &mut Self::Output<'_>) -> CuResult<()> {
        output.tov = Tov::Time(context.now());
        output.set_payload(black_box(Inertial::ONES));
        Ok(())
    }
}

/// Passes on what it gets, with its time of validity.
#[derive(Reflect)]
struct Pass;

impl Freezable for Pass {}

impl CuTask for Pass {
    type Resources<'r> = ();
    type Input<'m> = input_msg!(Inertial);
    type Output<'m> = output_msg!(Inertial);

    fn new(_: Option<&ComponentConfig>, _: Self::Resources<'_>) -> CuResult<Self> {
        Ok(Self)
    }

    fn process(&mut self, _: &CuContext, input: &Self::Input<'_>, output: &mut Self::Output<'_>) -> CuResult<()> {
        if let Some(payload) = input.payload() {
            output.tov = input.tov;
            output.set_payload(*payload);
        }
        Ok(())
    }
}

/// Takes what it gets.
#[derive(Reflect)]
struct Sink;

impl Freezable for Sink {}

impl CuSinkTask for Sink {
    type Resources<'r> = ();
    type Input<'m> = input_msg!(Inertial);

    fn new(_: Option<&ComponentConfig>, _: Self::Resources<'_>) -> CuResult<Self> {
        Ok(Self)
    }

    fn process(&mut self, _: &CuContext, input: &Self::Input<'_>) -> CuResult<()> {
        if let Some(payload) = input.payload() {
            black_box(payload);
            RECEIVED.store(RECEIVED.load(Ordering::Relaxed) + 1, Ordering::Relaxed);
        }
        Ok(())
    }
}

#[copper_runtime(config = "chain/copper.ron")]
struct Chain {}

/// Hands the started chain to `measure`, which iterates it; gives back what `measure` does, and how many messages the
/// sink has taken.
pub(crate) fn run<T>(measure: impl FnOnce(&mut dyn FnMut()) -> T) -> CuResult<(T, u64)> {
    // A builder without a logger takes the one that writes nothing.
    let mut running = Chain::builder().build()?.start()?;
    let mut result = Ok(());
    let measured = measure(&mut || {
        let iteration = running.run_one_iteration();
        if iteration.is_err() {
            result = iteration.map(|_| ());
        }
    });
    result?;
    running.stop()?;
    Ok((measured, RECEIVED.load(Ordering::Relaxed)))
}
