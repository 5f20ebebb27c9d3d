//! Copper's macro wants to know where to keep the strings of its log, also where nothing is logged.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if let Ok(folder) = std::env::var("OUT_DIR") {
        println!("cargo::rustc-env=LOG_INDEX_DIR={folder}");
    }
    let features = if std::env::var_os("CARGO_FEATURE_COPPER").is_some() { "copper" } else { "" };
    println!("cargo::rustc-env=COPPER_CFG_FEATURES={features}");
}
