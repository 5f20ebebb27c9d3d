//! Order of callbacks on many threads; and code that the robot calls, which may call it back.

use crate::kit::*;

static DONE: Mutex<Vec<f64>> = Mutex::new(Vec::new());

fn prepare(context: &Context) -> Done {
    context.request(Request::Continue(1));
    Ok(())
}

fn is_prepared(kept: &mut f64, _: u32) -> Replied {
    *kept = 1.0;
    Ok(Reply::none())
}

/// A robot whose estimators emit what they have prepared, and whose actuator notes what it is told, in order.
fn orderly() -> Builder<Plain> {
    let mut builder = Plain::builder();
    builder.options(SOURCE).read = |_, _| Ok(Reading::now(Number(1.0)));
    for estimator in [BEHIND, POSITION, APART] {
        let echo = builder.options(estimator);
        (echo.init, echo.go_on, echo.input) =
            (prepare, is_prepared, |kept: &mut f64, _| Ok(Reply::emit(Number(*kept))));
    }
    builder.options(SERVO).command = |number| {
        lock(&DONE).push(number);
        Ok(())
    };
    builder
}

#[test]
fn what_is_asked_for_in_init_comes_before_the_first_message() {
    within(120, || {
        for _ in 0..20 {
            let builder = orderly();
            let near = builder.subscribe(BEHIND);
            let apart = builder.subscribe(APART);
            let running = builder.start().expect("it starts");
            running.publish(NUMBER, running.clock().now(), Number(2.0));
            for prepared in [near, apart] {
                assert_eq!(prepared.recv_timeout(PATIENCE).map(|number| number.0), Some(1.0));
            }
            running.stop();
        }
    });
}

#[test]
fn commands_to_an_actuator_are_published_in_the_order_in_which_it_carried_them_out() {
    within(60, || {
        let running = armed(orderly());
        let room = Overflow::DropOldest { capacity: 10_000 };
        let told = running.subscribe_any(Select::Path(SERVO.path()), None, room);
        lock(&DONE).clear();
        std::thread::scope(|scope| {
            for thread in 0..4 {
                let running = &running;
                scope.spawn(move || {
                    for number in 0..1000 {
                        running.actuate(SERVO, Number(f64::from(1000 * thread + number))).expect("it is armed");
                    }
                });
            }
        });
        let numbers = told.drain().filter_map(|message| message.downcast::<Number>().map(|number| number.0));
        let (numbers, done): (Vec<_>, _) = (numbers.collect(), lock(&DONE).clone());
        assert_eq!(numbers.len(), 4000);
        let differs = numbers.iter().zip(&done).position(|(told, done)| told != done);
        assert_eq!(differs, None, "the first that was published at another place than it was carried out");
    });
}

#[test]
fn a_subscriber_of_a_system_topic_may_call_the_robot() {
    within(120, || {
        for topic in ["safety", "state", "parameter", "command"] {
            let builder = orderly();
            let (mut safety, mut state) =
                (builder.subscribe(system::SafetyState), builder.subscribe(system::StateMachine));
            let (mut parameter, mut command) =
                (builder.subscribe(plain::param::gain), builder.subscribe(plain::command::arm));
            let running = builder.start().expect("it starts");
            let (live, (called, is_called)) = (running.live(), mpsc::channel());
            let call = move || {
                live.set_parameter(plain::param::gain, 2.0).expect("it is finite");
                let _ = live.command(plain::command::disarm, NoArguments);
                let _ = live.disarm();
                let _ = live.arm();
                called.send((live.safety(), live.report().faults.len())).expect("the test waits for it");
            };
            match topic {
                "safety" => when_woken(&mut safety, call),
                "state" => when_woken(&mut state, call),
                "parameter" => when_woken(&mut parameter, call),
                _ => when_woken(&mut command, call),
            }
            running.set_parameter(plain::param::gain, 3.0).expect("it is finite");
            // Whoever was woken by the parameter arms it as well, on a thread of the pool.
            if topic != "parameter" {
                running.command(plain::command::arm, NoArguments).expect("it is disarmed");
            }
            let called = is_called.recv_timeout(PATIENCE);
            assert!(called.is_ok(), "{topic}: it hangs");
            running.stop();
        }
    });
}

#[test]
fn the_sink_of_a_journal_may_ask_the_robot() {
    within(120, || {
        let live: Arc<OnceLock<Live<Plain>>> = Arc::default();
        let (asked, is_asked) = mpsc::channel();
        let (seen, asked) = (Arc::clone(&live), Mutex::new(asked));
        let mut builder = orderly();
        builder.journal(move |_| {
            if let Some(live) = seen.get() {
                let _ = live.parameter(plain::param::gain);
                let _ = live.report();
                // Nobody may wait for it any more.
                let _ = lock(&asked).send((live.safety(), live.state()));
            }
        });
        let mut simulation = builder.simulate().expect("it starts");
        assert!(live.set(simulation.live()).is_ok());
        assert_eq!(simulation.arm(), Ok(()));
        simulation.set_parameter(plain::param::gain, 2.0).expect("it is finite");
        simulation.run_for(Duration::from_millis(3));
        assert_eq!(simulation.disarm(), Ok(()));
        assert!(is_asked.try_iter().count() > 5);
        simulation.stop();
    });
}

#[test]
fn a_subscriber_of_one_robot_may_ask_another_robot() {
    within(120, || {
        let builder = orderly();
        let mut position = builder.subscribe(POSITION);
        let running = builder.start().expect("it starts");
        let other = orderly().start().expect("it starts");
        let (live, (asked, is_asked)) = (other.live(), mpsc::channel());
        when_woken(&mut position, move || {
            let answer = live.call(POSITION, Ask);
            asked.send(answer.map_err(|fault| fault.to_string())).expect("the test waits for it");
        });
        running.publish(ENCODER, running.clock().now(), Number(1.0));
        assert_eq!(is_asked.recv_timeout(PATIENCE), Ok(Ok(1.0)));
    });
}
