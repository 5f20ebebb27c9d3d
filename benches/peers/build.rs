//! Copper's macro looks up where the strings of its log go. Nothing of ours is logged; it asks all the same.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if let Ok(folder) = std::env::var("OUT_DIR") {
        println!("cargo::rustc-env=LOG_INDEX_DIR={folder}");
    }
    let features = if std::env::var_os("CARGO_FEATURE_COPPER").is_some() { "copper" } else { "" };
    println!("cargo::rustc-env=COPPER_CFG_FEATURES={features}");
}
