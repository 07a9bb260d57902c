//! Core dumps: none, since the memory of a process holds pictures of people.

/// Forbids core dumps of this process and of those that it starts. Other processes of its user cannot read its memory
/// either, unless they may trace any process. Call it before anything is read.
pub fn forbid() {
    #[cfg(unix)]
    {
        use rustix::process::{Resource, Rlimit, setrlimit};
        let none = Rlimit {
            current: Some(0),
            maximum: Some(0),
        };
        // Every process may lower its limits.
        let _ = setrlimit(Resource::Core, none);
    }
    // A core that the kernel pipes to a program, as systemd-coredump, knows no limit.
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{DumpableBehavior, set_dumpable_behavior};
        let _ = set_dumpable_behavior(DumpableBehavior::NotDumpable);
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use rustix::process::{DumpableBehavior, Resource, dumpable_behavior, getrlimit};

    #[test]
    fn neither_a_file_nor_a_program_gets_the_memory() {
        super::forbid();
        let limit = getrlimit(Resource::Core);
        assert_eq!((limit.current, limit.maximum), (Some(0), Some(0)));
        let is_dumpable = dumpable_behavior().expect("known");
        assert_eq!(is_dumpable, DumpableBehavior::NotDumpable);
    }
}
