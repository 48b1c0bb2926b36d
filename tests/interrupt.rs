//! Ctrl-C, in a process of its own.
#![cfg(unix)]

use std::process::Command;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use macula::cli::output::interrupt_flag;

#[test]
fn ctrl_c_raises_the_flag_and_the_process_lives_on() {
    let flag = interrupt_flag().unwrap();
    assert!(!flag.load(Ordering::SeqCst));
    assert!(std::ptr::eq(flag, interrupt_flag().unwrap()));
    let own_id = std::process::id().to_string();
    let sent = Command::new("kill")
        .args(["-INT", &own_id])
        .status()
        .unwrap();
    assert!(sent.success());
    let patience = Instant::now() + Duration::from_secs(10);
    while !flag.load(Ordering::SeqCst) {
        assert!(Instant::now() < patience, "the flag never rose");
        std::thread::sleep(Duration::from_millis(5));
    }
}
