//! The `macula` binary: parse, call, exit code.

use std::process::ExitCode;

fn main() -> ExitCode {
    macula::cli::main()
}
