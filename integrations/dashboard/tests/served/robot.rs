//! A robot with something of everything.

use bb_core::prelude::*;

/// Name by a cruel author.
pub(crate) const HTML: &str = "<img src=x onerror=\"window.broken = true\">";

/// A number.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub(crate) struct Level {
    /// Amount.
    pub(crate) value: f64,
}

/// Emits its input.
#[derive(Debug)]
pub(crate) struct Pass;

impl Estimator for Pass {
    type Options = NoOptions;
    type Input = Level;
    type Output = Level;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }
    fn handle_input(&mut self, level: &Stamped<Level>) -> Result<Reply<Level>, Fault> {
        match level.value {
            value if value < 0.0 => Err(Fault::new(format!("{HTML}{}", "x".repeat(300_000)))),
            _ => Ok(Reply::emit(level.payload)),
        }
    }
}

/// Arguments of [`Travel`].
#[derive(Clone, Copy, Debug, Default, Payload)]
pub(crate) struct Distance {
    /// Distance.
    #[payload(unit = "m")]
    pub(crate) distance: f64,
}

/// Takes as many seconds as metres.
#[derive(Debug)]
pub(crate) struct Travel;

impl Command for Travel {
    type Options = NoOptions;
    type Arguments = Distance;
    type Output = f64;

    async fn run(_: NoOptions, of: Distance, context: CommandContext) -> Result<Outcome<f64>, Fault> {
        context.sleep(Duration::from_secs_f64(of.distance)).await;
        Ok(Outcome::done(of.distance * 2.0))
    }
}

robot! {
    pub(crate) robot Cart;
    parameters {
        /// Speed.
        speed: f64 = 0.5 m/s, range: 0 m/s..=1.5 m/s;
        count: i64 = 3;
    }
    commands {
        travel: Travel { allowed_states: [idle]; }
        on: Arm;
    }
    link base {
        sensor level: External<Level>();
        estimator pass: Pass() { input level: sensor::base::level; lost_after: 200 ms; recover_after: 1; }
    }
}

/// A robot whose links name files of meshes.
pub(crate) mod shaped {
    use bb_core::prelude::*;

    robot! {
        pub(crate) robot Shaped;
        link base {
            visual: { mesh: { file: "package://shaped/dish.stl" } };
            visual: { mesh: { file: "package://shaped/../Cargo.toml" } };
            visual: { mesh: { file: "missing.stl", scale: [1, 1, 2] } };
        }
    }
}

/// Some other robot.
pub(crate) mod other {
    use bb_core::prelude::*;

    robot! {
        pub(crate) robot Other;
        parameters { depth: f64 = 1.0; }
        link base;
    }
}

/// A robot that serves its own dashboard.
pub(crate) mod own {
    use bb_core::prelude::*;
    use bb_dashboard::Dashboard;

    robot! {
        pub(crate) robot Own;
        bridges { bridge dashboard: Dashboard(port = 0, print = false); }
        link base;
    }
}
