//! Commands in the guides print what the guides say. `UPDATE_GUIDES=1` rewrites it.

use crate::common::poses;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A folder with the example's recording, as a checkout has it, and a recording of a chip in its own units.
fn scratch(name: &str) -> PathBuf {
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
    std::fs::copy(crate::cart::cart(&format!("guide_cart_{name}.mcap"), true), folder.join("own.mcap"))
        .expect("copies");
    std::fs::write(folder.join("oxts.txt"), oxts()).expect("writes");
    std::fs::create_dir_all(folder.join("Nexus5_AR")).expect("makes");
    for (name, text) in smartphone() {
        std::fs::write(folder.join(name), text).expect("writes");
    }
    let log = rest(|index| format!("0.119,0.027,1.013,-0.671,3.082,0.198,{}", 261_906 + 10 * index));
    std::fs::write(folder.join("imu_1934.csv"), log).expect("writes");
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

/// Runs each block of commands that is followed by what it prints.
fn check(guide: &str) {
    let path = root().join(guide);
    let text = std::fs::read_to_string(&path).expect("is there");
    let lines: Vec<&str> = text.lines().collect();
    let folder = scratch(&guide.replace('/', "_"));
    let blocks = blocks(&lines);
    let mut new: Vec<String> = Vec::new();
    let mut copied = 0;
    let mut runs = 0;
    let is_update = std::env::var_os("UPDATE_GUIDES").is_some();
    for (index, &(start, end, language)) in blocks.iter().enumerate() {
        // A file is named on the line before it.
        if language == "toml" && lines[start] == "[[file]]" {
            std::fs::write(folder.join("phone.toml"), lines[start..end].join("\n") + "\n").expect("writes");
            run("bb convert phone.toml described.mcap", &folder, true);
        }
        if language == "csv" {
            let name = lines[start - 3].trim_matches(['`', ':']);
            std::fs::write(folder.join(name), lines[start..end].join("\n") + "\n").expect("writes");
        }
        let commands = lines[start..end].iter().map(|line| line.split("   #").next().unwrap_or(""));
        let commands = commands.collect::<Vec<_>>().join("\n").replace("\\\n", " ");
        let commands: Vec<&str> = commands.lines().collect();
        if language != "sh" || !commands.iter().any(|line| line.starts_with("bb ")) {
            continue;
        }
        runs += 1;
        // What they print comes next, with an empty line between; of others it is enough that they work.
        let output = blocks.get(index + 1).filter(|block| block.2 == "text" && block.0 == end + 3);
        let printed: Vec<String> = commands.iter().map(|line| run(line, &folder, output.is_none())).collect();
        let printed = printed.concat();
        let Some(&(out, out_end, _)) = output else { continue };
        let told = lines[out..out_end].join("\n");
        if !is_update {
            assert_eq!(lasting(&told), lasting(printed.trim_end()), "{guide}: {}", commands.join("\n"));
        }
        if lasting(&told) == lasting(printed.trim_end()) {
            continue;
        }
        new.extend(lines[copied..out].iter().map(|line| (*line).to_owned()));
        new.extend(printed.trim_end().lines().map(|line| line.trim_end().to_owned()));
        copied = out_end;
    }
    assert!(runs > 0, "{guide} shows no command");
    if is_update {
        new.extend(lines[copied..].iter().map(|line| (*line).to_owned()));
        std::fs::write(path, new.join("\n") + "\n").expect("writes");
    }
}

#[test]
fn the_guide_to_the_command() {
    check("book/src/how-to/command.md");
}

#[test]
fn the_guide_to_calibration() {
    check("book/src/how-to/calibrate.md");
    // What the robot in it is given is what the command printed.
    let text = std::fs::read_to_string(root().join("book/src/how-to/calibrate.md")).expect("is there");
    let options: Vec<&str> = text.lines().filter(|line| line.starts_with("                ")).collect();
    assert!(options.len() >= 2, "{options:?}");
    for option in options {
        let printed = option.trim().trim_end_matches(',');
        assert!(text.lines().any(|line| line == printed), "it prints no `{printed}`");
    }
}

#[test]
fn the_readme() {
    check("README.md");
}
