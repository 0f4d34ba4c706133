//! What the harness says of arguments that it cannot use.

use std::process::Command;

fn refused(arguments: &[&str]) -> String {
    let done = Command::new(env!("CARGO_BIN_EXE_espalier-bench")).args(arguments).output().unwrap();
    assert!(!done.status.success() && done.stdout.is_empty(), "{done:?}");
    String::from_utf8(done.stderr).unwrap()
}

#[test]
fn unknown_ones_are_told_with_the_known() {
    for arguments in [&[][..], &["run", "plan.json"], &["race"]] {
        let message = refused(arguments);
        assert!(
            message.starts_with("espalier-bench: ") && message.contains("race PLAN, turns PLAN, hits PLAN"),
            "{message}"
        );
    }
}

#[test]
fn a_plan_that_is_not_there_is_named() {
    let message = refused(&["race", "no/such/plan.json"]);
    assert!(message.starts_with("espalier-bench: ") && message.contains("no/such/plan.json"), "{message}");
}
