//! Renders that are killed at any moment go on bit by bit from their checkpoint, which is whole or not there.

use crate::support::program::Sandbox;
use std::time::Duration;

/// Iterations of a render that is killed.
const ITERATIONS: u64 = 48;

/// Pseudo-random delays before kills, in microseconds: from the start of the program to the end of its render.
fn delay(n: u64) -> Duration {
    Duration::from_micros(15_000 + n.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(20) % 85_000)
}

/// Kills a render of each integrator `kills` times, saving after every iteration, and compares what comes of it with an
/// uninterrupted one. Returns the number of renders that were killed before their end, and of those that had a
/// checkpoint then.
fn kill(kills: u64) -> [u64; 2] {
    let (mut killed, mut resumed) = (0, 0);
    for (i, spec) in lightsieve::integrators::REGISTRY.iter().enumerate() {
        let sandbox = Sandbox::new();
        let name = spec.name;
        let render = format!("render scene.xml -i {name} --size 24x24 --spp {ITERATIONS} --quiet");
        sandbox.run(&format!("{render} -o whole.pfm")).expect(0, &[]);
        let saving = |sandbox: &Sandbox| {
            let exists = sandbox.path("c").exists();
            let option = if exists { "--resume" } else { "--checkpoint" };
            (exists, format!("{render} -o killed.pfm {option} c --checkpoint-interval 1ms"))
        };
        for k in 0..kills {
            let (exists, command) = saving(&sandbox);
            resumed += u64::from(exists);
            let mut process = sandbox.start(&command);
            std::thread::sleep(delay(i as u64 * 1000 + k));
            if process.child.try_wait().unwrap().is_none() {
                process.child.kill().unwrap();
                killed += 1;
            }
            process.child.wait().unwrap();
            if sandbox.path("killed.pfm").exists() {
                // This one was quicker: begin anew.
                assert_eq!(sandbox.read("killed.pfm"), sandbox.read("whole.pfm"), "{name} after {k} kills");
                for file in ["killed.pfm", "c"] {
                    std::fs::remove_file(sandbox.path(file)).unwrap();
                }
            }
        }
        sandbox.run(&saving(&sandbox).1).expect(0, &[]);
        assert_eq!(sandbox.read("killed.pfm"), sandbox.read("whole.pfm"), "{name}");
        let left = std::fs::read_dir(sandbox.path("")).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
        let mut left: Vec<String> = left.collect();
        left.sort();
        assert_eq!(left, ["c", "killed.pfm", "scene.xml", "whole.pfm"], "{name}: temporary files of killed renders");
    }
    [killed, resumed]
}

/// Each integrator is killed 3 times, or as often as KILLS says.
#[test]
fn killed_renders_go_on_bit_by_bit() {
    let times = std::env::var("KILLS").ok().and_then(|kills| kills.parse().ok()).unwrap_or(3);
    let [killed, resumed] = kill(times);
    println!("{killed} renders were killed; {resumed} began from a checkpoint");
    assert!(killed > 0);
}
