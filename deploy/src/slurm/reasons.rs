//! Slurm's reasons in words.

/// Reasons of squeue(1), "JOB REASON CODES", and what they mean for whoever waits.
const REASONS: &[(&str, &str)] = &[
    ("Priority", "jobs of higher priority are before it in the queue"),
    ("Resources", "it waits for cores or memory to become free"),
    ("BeginTime", "it is before its start time; Slurm holds back what is started again for 120 s"),
    ("Dependency", "it waits for another job"),
    ("DependencyNeverSatisfied", "it waits for a job that can never end as asked: remove it"),
    ("JobHeldUser", "it is held: scontrol release JOB"),
    ("JobHeldAdmin", "an administrator holds it"),
    ("JobArrayTaskLimit", "the array may run no more tasks at a time"),
    (
        "PartitionDown",
        "the partition takes jobs and starts none: ask the administrator, or give another with -p",
    ),
    ("PartitionInactive", "the partition starts no jobs: give another with -p"),
    ("PartitionNodeLimit", "it asks for more nodes than the partition gives"),
    ("PartitionTimeLimit", "it asks for more time than the partition gives: give less with --time"),
    ("NodeDown", "a node that it needs is down"),
    ("BadConstraints", "no node has what it asks for"),
    ("Licenses", "it waits for a licence"),
    ("Reservation", "it waits for its reservation"),
    ("Cleaning", "its last start is being cleaned up"),
    ("AccountNotAllowed", "the account may not use this partition: give another with -A"),
    ("InvalidAccount", "the account does not exist: give another with -A"),
    ("InvalidQOS", "the quality of service does not exist: give another with --qos"),
    ("NonZeroExitCode", "it ended with an exit code that is not zero"),
    ("TimeLimit", "the time limit of the job was reached"),
    ("OutOfMemory", "it used more memory than the job was given"),
    ("JobLaunchFailure", "it could not be started on its node"),
    ("RaisedSignal", "it was ended by a signal"),
    ("SystemFailure", "Slurm failed"),
];

/// Beginnings of reasons that tell limits.
const LIMITS: &[(&str, &str)] = &[
    ("QOS", "a limit of the quality of service is reached"),
    ("Assoc", "a limit of the account is reached"),
    ("MaxCpuPerAccount", "a limit of the account is reached"),
    ("ReqNodeNotAvail", "nodes that it needs are down, reserved or drained"),
    ("Nodes_required_for_job_are_DOWN", "nodes that it needs are down, reserved or drained"),
    ("launch_failed_requeued_held", "it could not be started on its node and is held: scontrol release JOB"),
    ("launch failed", "it could not be started on its node and is held: scontrol release JOB"),
];

/// A reason with its meaning; Slurm's word alone where it is another.
pub(super) fn says(reason: &str) -> String {
    let exact = REASONS.iter().find(|(word, _)| *word == reason);
    let begins = || LIMITS.iter().find(|(word, _)| reason.starts_with(word));
    match exact.or_else(begins) {
        Some((_, meaning)) => format!("{reason}: {meaning}"),
        None => reason.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reason_keeps_slurms_word_and_says_what_it_means() {
        assert_eq!(says("Resources"), "Resources: it waits for cores or memory to become free");
        assert!(says("QOSMaxJobsPerUserLimit").ends_with("quality of service is reached"));
        assert_eq!(says("SomethingNew"), "SomethingNew");
    }
}
