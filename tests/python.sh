# Sourced by the checks beside other projects. `python_with PACKAGES` sets `python` to one that has these packages of PyPI, in a
# virtual environment in the target folder. `PYTHON` names another one, to which nothing is added.
python_with() {
    if [ -n "${PYTHON:-}" ]; then
        python="$(command -v "$PYTHON")"
        return
    fi
    local folder="${CARGO_TARGET_DIR:-$PWD/target}/python"
    python="$folder/bin/python"
    [ -x "$python" ] || python3 -m venv "$folder"
    "$python" -m pip install --quiet --no-compile --disable-pip-version-check "$@"
}

# Runs tests of the workspace that are ignored otherwise, by the words in their names, with what `cargo test --workspace` has built.
run_ignored() {
    local log
    log="$(mktemp)"
    cargo test --workspace --tests --locked -- --ignored "$@" >"$log" 2>&1 || { cat "$log"; rm "$log"; return 1; }
    grep -E '^test .* ok$' "$log" || { echo "no test has the name $*"; rm "$log"; return 1; }
    rm "$log"
}
