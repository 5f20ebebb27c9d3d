//! Commands in the README and in the book: each is run, and prints what the page shows below it. `UPDATE_GUIDES=1` rewrites that. Those on
//! recordings that are no part of the checkout are run by a test that needs them, and of cargo's the targets exist.

use crate::common::poses;
use crate::{cart, noise};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A folder with the example's recording, as a checkout has it, and the recordings that a document names.
fn scratch(name: &str, document: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("guide_{name}"));
    let _ = std::fs::remove_dir_all(&folder);
    let data = folder.join("examples/data");
    std::fs::create_dir_all(&data).expect("makes");
    std::fs::copy(root().join("examples/data/broad_07.mcap"), data.join("broad_07.mcap")).expect("copies");
    std::fs::write(folder.join("chip.csv"), chip()).expect("writes");
    std::fs::write(folder.join("01.csv"), broad()).expect("writes");
    std::fs::write(folder.join("TStick_Test02_Trial2.csv"), repoimu()).expect("writes");
    std::fs::copy(
        poses::bag(&poses::samples(&poses::errors()), &format!("guide_{name}.mcap"), true),
        folder.join("poses.mcap"),
    )
    .expect("copies");
    std::fs::copy(cart::cart(&format!("guide_cart_{name}.mcap"), true), folder.join("own.mcap")).expect("copies");
    std::fs::write(folder.join("oxts.txt"), oxts()).expect("writes");
    std::fs::create_dir_all(folder.join("Nexus5_AR")).expect("makes");
    for (name, text) in smartphone() {
        std::fs::write(folder.join(name), text).expect("writes");
    }
    let log = rest(|index| format!("0.119,0.027,1.013,-0.671,3.082,0.198,{}", 261_906 + 10 * index));
    std::fs::write(folder.join("imu_1934.csv"), log).expect("writes");
    if document.contains("night.mcap") {
        let night = noise::bag(&format!("guide_{name}_night.mcap"), &noise::night(1, 900.0));
        std::fs::copy(night, folder.join("night.mcap")).expect("copies");
    }
    let (imu, truth) = euroc();
    for (name, text) in [("imu0/data.csv", imu), ("state_groundtruth_estimate0/data.csv", truth)] {
        let file = folder.join("mav0").join(name);
        std::fs::create_dir_all(file.parent().expect("has one")).expect("makes");
        std::fs::write(file, text).expect("writes");
    }
    let tests = root().join("bb-cli/tests/data");
    for (from, to) in [("ros1.bag", "drive.bag"), ("px4.ulg", "flight.ulg")] {
        std::fs::copy(tests.join(from), folder.join(to)).expect("copies");
    }
    for (name, columns) in
        [("gyroscope.txt", "0,0,0.1"), ("accelerometer.txt", "0,0,9.81"), ("magnetometer.txt", "0,20,-43")]
    {
        let time = |index| 1_556_695_561.0 + index as f64 * 0.01;
        std::fs::write(folder.join(name), rest(|index| format!("{:.2},{columns}", time(index)))).expect("writes");
    }
    let head = "%  GPST latitude(deg) longitude(deg) height(m) Q ns sdn(m) sde(m) sdu(m) sdne(m) sdeu(m) sdun(m) age(s) ratio\n";
    let fix = "2019/05/01 07:26:19.500 48.137 11.575 520.0 1 9 0.02 0.01 0.05 0 0 0 0.5 3.0\n";
    for name in ["rover.pos", "reference.pos"] {
        std::fs::write(folder.join(name), [head, fix].concat()).expect("writes");
    }
    folder
}

/// Two seconds of rest at 100 Hz, in the layout of each data set.
fn rest(line: impl Fn(u64) -> String) -> String {
    (0..200).map(|index| line(index) + "\n").collect()
}

/// Returns a rest as `numpy.savetxt` writes it.
fn broad() -> String {
    rest(|_| {
        let imu = "0e+00,0e+00,0e+00,0e+00,0e+00,9.81e+00,0e+00,2.0e+01,-4.3e+01";
        format!("{imu},1e+00,0e+00,0e+00,0e+00,nan,nan,nan,1e+00")
    })
}

fn repoimu() -> String {
    let head = "Time (s);Vicon Orientation;;;;IMU Acceleration;;;IMU Gyroscope;;;IMU Magnetometer;;;\n;W;X;Y;Z;X;Y;Z;X;Y;Z;X;Y;Z;\n";
    let time = |index| index as f64 * 0.01;
    head.to_owned() + &rest(|index| format!("{};1;-1e-005;0;0;0;0;9.81;0;0;1e-003;0;0.4;-0.9", time(index)))
}

fn euroc() -> (String, String) {
    let time = |index: u64| 1_403_636_579_758_555_392 + index * 10_000_000;
    let head = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],\
                a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
    let imu = head.to_owned() + &rest(|index| format!("{},0,0,0,0,0,9.81", time(index)));
    let head = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n";
    (imu, head.to_owned() + &rest(|index| format!("{},4.6,-1.8,0.8,1,0,0,0", time(index))))
}

/// Two seconds of KITTI's inertial system, a line from each of its files: latitude, longitude, height, three angles, five velocities, three
/// accelerations twice, three angular velocities twice, and six of accuracy and state.
fn oxts() -> String {
    rest(|_| {
        let (place, angles) =
            ("49.015003823272 8.4342971002335 116.43032836914", "0.035447 0.00966 -0.7202638980385");
        let (velocities, force) = ("0 0 9 0 0", "0.1 0.2 9.81 0.1 0.2 9.8");
        format!("{place} {angles} {velocities} {force} 0 0 0.01 0 0 0.01 0.05 0.01 4 11 4 4 0")
    })
}

/// The files of a smartphone, with spaces: time and axes.
fn smartphone() -> [(&'static str, String); 3] {
    let of = |columns: &'static str| rest(|index| format!("{:.9} {columns}", 0.417_457_403 + index as f64 * 0.005));
    [
        (
            "Nexus5_AR/gyroscope.txt",
            of("0.04737854 -0.07136536 6.2561035E-4 0.013793947 -0.0052337646 0.070999146"),
        ),
        ("Nexus5_AR/accelerometer.txt", of("0.1 0.2 9.81")),
        ("Nexus5_AR/magnetometer.txt", of("0.1 20.0 -43.0")),
    ]
}

/// Twelve seconds at 100 Hz, with a pause: turns about x, in deg/s, g and µT.
fn chip() -> String {
    let mut text = "t,gx,gy,gz,ax,ay,az,mx,my,mz\n".to_owned();
    for index in (0..1200).filter(|index| !(700..760).contains(index)) {
        let time = f64::from(index) * 0.01;
        // The angle is the integral of the rate.
        let (rate, angle) = (time.sin().to_degrees(), 1.0 - time.cos());
        let (sin, cos) = angle.sin_cos();
        let (time, field) = (1.7e9 + time, (20.0 * cos - 43.0 * sin, -20.0 * sin - 43.0 * cos));
        writeln!(text, "{time:.2},{rate:.4},0,0,0,{sin:.4},{cos:.4},0,{:.2},{:.2}", field.0, field.1)
            .expect("writes");
    }
    text
}

/// Runs a line of a shell, of `bb` and of the few others that the guides need, and returns what it prints. With
/// `is_right` it must end well.
fn run(line: &str, folder: &Path, is_right: bool) -> String {
    // Words in single quotes are one.
    let parts = line.split('\'').enumerate();
    let words: Vec<&str> = parts
        .flat_map(|(index, part)| match index % 2 {
            0 => part.split_whitespace().collect(),
            _ => vec![part],
        })
        .collect();
    match words[..] {
        ["bb", ..] => {
            let output = Command::new(env!("CARGO_BIN_EXE_bb"))
                .current_dir(folder)
                .args(&words[1..])
                .output()
                .expect("runs");
            assert!(output.status.success() || !is_right, "{line}\n{}", String::from_utf8_lossy(&output.stderr));
            [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).expect("is text")).concat()
        }
        ["head", "-c", length, from, ">", to] => {
            let bytes = std::fs::read(folder.join(from)).expect("is there");
            std::fs::write(folder.join(to), &bytes[..length.parse().expect("a number")]).expect("writes");
            String::new()
        }
        ["cargo", "install", ..] => String::new(),
        _ => panic!("the test cannot run `{line}`"),
    }
}

/// Returns the part of a text that is the same in each run: the time that a filter took is not.
fn lasting(text: &str) -> String {
    let has_times = text.contains("ns/update");
    let line = |line: &str| match line.rsplit_once(' ') {
        Some((rest, time)) if has_times && time.parse::<u64>().is_ok() => rest.trim_end().to_owned(),
        _ => line.trim_end().to_owned(),
    };
    text.lines().map(line).collect::<Vec<_>>().join("\n").replace("samples  ns/update", "samples ns/update")
}

/// A block of code: where its lines begin and end, and its language.
fn blocks<'a>(lines: &[&'a str]) -> Vec<(usize, usize, &'a str)> {
    let mut blocks = Vec::new();
    let mut open: Option<(usize, &str)> = None;
    for (index, line) in lines.iter().enumerate() {
        match (line.strip_prefix("```"), open) {
            (Some(_), Some((start, language))) => {
                blocks.push((start, index, language));
                open = None;
            }
            (Some(language), None) => open = Some((index + 1, language)),
            (None, _) => {}
        }
    }
    blocks
}

/// Tells whether a document shows what is printed; a line `…` matches any number of lines.
fn is_shown(shown: &str, printed: &str) -> bool {
    let mut rest = printed;
    for (index, part) in shown.split("…\n").enumerate() {
        let found = if index == 0 { rest.starts_with(part).then_some(0) } else { rest.find(part) };
        let Some(at) = found else { return false };
        rest = &rest[at + part.len()..];
    }
    rest.trim().is_empty() || shown.ends_with("…\n")
}

/// The lines of a block of commands, continued ones joined, without comments.
fn commands(block: &[&str]) -> Vec<String> {
    let lines = block.iter().map(|line| line.split("  #").next().unwrap_or("").trim_end());
    let text = lines.collect::<Vec<_>>().join("\n").replace("\\\n", " ");
    text.lines().map(str::to_owned).filter(|line| !line.is_empty()).collect()
}

/// Tells whether the first line of a block says what it needs that a test does not have.
fn is_marked(block: &[&str]) -> bool {
    block.first().is_some_and(|line| line.starts_with("# needs "))
}

/// Tells whether a block is about recordings that are no part of the checkout.
fn needs_recordings(block: &[&str]) -> bool {
    block.iter().any(|line| ["$BB_DATA", "$V/", "$D/"].iter().any(|folder| line.contains(folder)))
}

/// Checks that the packages and targets that a command of cargo names are there.
fn check_targets(command: &str) {
    let (folder, command) = match command.strip_prefix("cd ").and_then(|rest| rest.split_once(" && ")) {
        Some((folder, command)) => (root().join(folder), command),
        None => (root(), command),
    };
    let (command, _) = command.split_once(" -- ").unwrap_or((command, ""));
    let words: Vec<&str> = command.split_whitespace().collect();
    let output = Command::new(env!("CARGO"))
        .current_dir(&folder)
        .args(["metadata", "--no-deps", "--offline", "--format-version", "1"])
        .output()
        .expect("runs");
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).expect("is JSON");
    let packages = metadata["packages"].as_array().expect("a list");
    let has_target = |kind: &str, name: &str| {
        let mut targets = packages.iter().flat_map(|package| package["targets"].as_array().into_iter().flatten());
        targets.any(|target| target["kind"][0] == kind && target["name"] == name)
    };
    for pair in words.windows(2) {
        let is_there = match pair[0] {
            "-p" => packages.iter().any(|package| package["name"] == pair[1]),
            "--example" | "--bench" | "--test" | "--bin" => has_target(pair[0].trim_start_matches('-'), pair[1]),
            "--path" => folder.join(pair[1]).join("Cargo.toml").exists(),
            _ => true,
        };
        assert!(is_there, "`{command}` names `{}`, which is not there", pair[1]);
    }
}

/// Runs the commands of a document, compares what they print where it is shown, and returns how many there are.
fn check(guide: &str) -> usize {
    let path = root().join(guide);
    let text = std::fs::read_to_string(&path).expect("is there");
    let lines: Vec<&str> = text.lines().collect();
    let blocks = blocks(&lines);
    if !blocks.iter().any(|block| block.2 == "sh") {
        return 0;
    }
    let folder = scratch(&guide.replace('/', "_"), &text);
    let mut new: Vec<String> = Vec::new();
    let mut copied = 0;
    let mut runs = 0;
    let is_update = std::env::var_os("UPDATE_GUIDES").is_some();
    for (index, &(start, end, language)) in blocks.iter().enumerate() {
        let block = &lines[start..end];
        if language != "sh" || is_marked(block) {
            continue;
        }
        // What they print comes next, with an empty line between; of others it is enough that they work.
        let output = blocks.get(index + 1).filter(|block| block.2 == "text" && block.0 == end + 3);
        let mut printed = String::new();
        for command in commands(block) {
            if command.starts_with("cargo ") || command.starts_with("cd ") {
                check_targets(&command);
            } else if !needs_recordings(block) || command.starts_with("bb ") && !command.contains('$') {
                printed += &run(&command, &folder, output.is_none());
            }
            runs += 1;
        }
        let Some(&(out, out_end, _)) = output.filter(|_| !printed.is_empty()) else { continue };
        let shown = lasting(&lines[out..out_end].join("\n"));
        let printed = printed.trim_end();
        if is_shown(&(shown.clone() + "\n"), &(lasting(printed) + "\n")) {
            continue;
        }
        assert!(is_update, "{guide}: {}\n{shown}\n\nis shown, and this is printed:\n{printed}", block.join("\n"));
        new.extend(lines[copied..out].iter().map(|line| (*line).to_owned()));
        new.extend(printed.lines().map(|line| line.trim_end().to_owned()));
        copied = out_end;
    }
    if copied > 0 {
        new.extend(lines[copied..].iter().map(|line| (*line).to_owned()));
        std::fs::write(path, new.join("\n") + "\n").expect("writes");
    }
    runs
}

/// The README and the pages of the book, by their paths in the project.
fn documents() -> Vec<String> {
    let summary = std::fs::read_to_string(root().join("book/src/SUMMARY.md")).expect("is there");
    let pages = summary.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    pages.map(|page| format!("book/src/{page}")).chain(["README.md".to_owned()]).collect()
}

#[test]
fn commands_of_the_book_print_what_it_shows() {
    let runs: usize = std::thread::scope(|scope| {
        let checks: Vec<_> =
            documents().into_iter().map(|document| scope.spawn(move || check(&document))).collect();
        checks.into_iter().map(|check| check.join().expect("its fault is printed above")).sum()
    });
    assert!(runs > 60, "{runs}");
}

/// Blocks about other recordings, each in a shell. `bb eval families` is left to the long test that measures it.
#[test]
#[ignore = "needs the recordings that BB_DATA names"]
fn recorded_commands_of_the_book() {
    let folder = scratch("recorded", "");
    let mut runs = 0;
    for document in documents() {
        let text = std::fs::read_to_string(root().join(&document)).expect("is there");
        let lines: Vec<&str> = text.lines().collect();
        for (start, end, language) in blocks(&lines) {
            let block = &lines[start..end];
            if language != "sh" || is_marked(block) || !needs_recordings(block) {
                continue;
            }
            let is_run = |line: &String| {
                !line.starts_with("bb eval families") && !line.starts_with("cargo run --release --example")
            };
            let lines: Vec<String> = commands(block).into_iter().filter(is_run).collect();
            let script = lines.join("\n").replace("cargo run --release -p bb-command --", "bb");
            if script.contains("cargo ") || !script.contains('$') {
                continue;
            }
            let output = Command::new("bash")
                .current_dir(&folder)
                .args(["-euc", &format!("bb() {{ \"{}\" \"$@\"; }}\n{script}", env!("CARGO_BIN_EXE_bb"))])
                .output()
                .expect("runs");
            assert!(output.status.success(), "{document}: {script}\n{}", String::from_utf8_lossy(&output.stderr));
            runs += 1;
        }
    }
    assert!(runs > 2, "{runs}");
}

#[test]
fn calibration_shown_in_a_robot_is_that_of_the_command() {
    let text = std::fs::read_to_string(root().join("book/src/how-to/calibrate.md")).expect("is there");
    let options: Vec<&str> = text.lines().filter(|line| line.starts_with("                ")).collect();
    assert!(options.len() >= 2, "{options:?}");
    for option in options {
        let printed = option.trim().trim_end_matches(',');
        assert!(text.lines().any(|line| line == printed), "it prints no `{printed}`");
    }
}
