//! `starlings deploy pbs` with programs in the place of PBS that take command lines as its manual says, and no others.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod deploy_kit;

use common::repository;
use deploy_kit::Site;
use serde_json::Value;

/// Takes options by the synopsis of a manual page; what else stands there is a usage error, as of the real programs (exit code 2).
fn strict(options: &str, cases: &str, rest: &str) -> String {
    format!(
        "usage() {{ echo \"usage: $0 $*\" >&2; exit 2; }}
line=\"$*\"
while getopts :{options} o; do case $o in
{cases}
[:?]) usage \"$line\";;
esac; done
shift $((OPTIND - 1))
{rest}"
    )
}

/// A PBS of which every task has the same state: attributes of the form that `qstat -f -F json` has.
fn pbs(attributes: &str) -> Site {
    // qsub(1B): one script at the end; a range X-Y with Y above X.
    let qsub = strict(
        "a:A:c:C:e:fhIj:J:k:l:m:M:N:o:p:P:q:r:R:S:u:v:VW:z",
        "N) echo $OPTARG > $SITE/name;;
J) [ ${OPTARG%-*} -lt ${OPTARG#*-} ] || usage \"$line\"; echo $OPTARG > $SITE/range;;
j) [ $OPTARG = oe ] || usage \"$line\";;
o) [ $OPTARG = /dev/null ] || usage \"$line\";;
q) [ $OPTARG = work ] || { echo \"qsub: Unknown queue\" >&2; exit 170; };;
A) [ $OPTARG = ours ] || { echo \"qsub: Invalid account MSG=invalid account\" >&2; exit 15; };;",
        "[ $# -eq 1 ] && [ -f \"$1\" ] || usage \"$line\"
echo \"$line\" >> $SITE/submitted
if [ -e $SITE/range ]; then echo '17[].head'; else echo 17.head; fi",
    );
    // qselect(1B): no operands; finished jobs with -x only.
    let qselect = strict(
        "a:A:c:h:HJl:N:p:P:q:r:s:t:Tu:x",
        "N) name=$OPTARG;;\nx) x=1;;\n[aAchHJlpPqrstTu]) ;;",
        "[ $# -eq 0 ] || usage \"$line\"
[ -e $SITE/submitted ] || exit 0
read own < $SITE/name
[ \"$name\" = \"$own\" ] || exit 0
[ -e $SITE/deleted ] && [ -z \"$x\" ] && exit 0
if [ -e $SITE/range ]; then echo '17[].head'; else echo 17.head; fi",
    );
    // qstat(1B): numbers of jobs; -t shows the tasks of an array, -x what has ended.
    let qstat = strict(
        "fF:D:EJptwx",
        "f) f=1;;\nF) [ $OPTARG = json ] || usage \"$line\";;\nt) t=1;;\nx) x=1;;\n[DEJpw]) ;;",
        &format!(
            "[ -n \"$f\" ] && [ -n \"$t\" ] && [ -n \"$x\" ] && [ $# -eq 1 ] || usage \"$line\"
task() {{ if [ -e $SITE/deleted ]; then echo \"\\\"$1\\\":{{ \\\"job_state\\\":\\\"F\\\", \\\"Exit_status\\\":271 }}\"; else echo \"\\\"$1\\\":{{ {attributes} }}\"; fi; }}
echo '{{ \"timestamp\":1000, \"pbs_version\":\"20.0.1\", \"pbs_server\":\"head\", \"Jobs\":{{'
case $1 in
'17[].head') echo '\"17[].head\":{{ \"job_state\":\"B\", \"array\":\"True\" }},'; task '17[0].head'; echo ,; task '17[1].head';;
17.head) task 17.head;;
*) echo \"qstat: Unknown Job Id $1\" >&2; exit 153;;
esac
echo '}} }}'"
        ),
    );
    // qdel(1B): numbers of jobs.
    let qdel = strict(
        "W:x",
        "[Wx]) ;;",
        "[ $# -eq 1 ] || usage \"$line\"
case $1 in '17[].head'|17.head) echo \"$1\" > $SITE/deleted;; *) echo \"qdel: Unknown Job Id $1\" >&2; exit 153;; esac",
    );
    Site::new()
        .program("qsub", &qsub)
        .program("qselect", &qselect)
        .program("qstat", &qstat)
        .program("qdel", &qdel)
}

const RUNNING: &str = "\\\"job_state\\\":\\\"R\\\", \\\"exec_host\\\":\\\"n1/0\\\"";

fn deploy(site: &Site, options: &[&str]) -> (i32, String) {
    let study = repository("examples/rcr/study.toml");
    site.said(&[&["pbs", study.to_str().unwrap(), "--out", "pool"], options].concat())
}

#[test]
fn an_array_of_workers_is_submitted_asked_and_removed_in_the_forms_of_the_manual() {
    let site = pbs(RUNNING);
    let (code, said) =
        deploy(&site, &["--workers", "2", "--slots", "4", "--", "-q", "work", "-l", "walltime=2:00:00"]);
    assert!(code == 0 && said.contains("submitted 2 workers as") && said.contains("2 of 2 run"), "{said}");
    let submitted = std::fs::read_to_string(site.path("submitted")).unwrap();
    assert!(submitted.starts_with("-q work -l walltime=2:00:00 -N starlings-rcr-"), "{submitted}");
    assert!(submitted.contains(" -j oe -o /dev/null -J 0-1 /"), "{submitted}");
    let script = std::fs::read_to_string(site.path("pool/worker.pbs")).unwrap();
    for line in ["#PBS -J 0-1\n", "#PBS -r y\n", "#PBS -l select=1:ncpus=4\n", "--slots \"4\"", "--idle 10m"]
    {
        assert!(script.contains(line), "{line}: {script}");
    }
    let (code, json) = site.said(&["status", "pool", "--json"]);
    let status: Value = serde_json::from_str(&json).unwrap();
    assert_eq!((code, &status["engine"], &status["tasks"][1]["node"]), (0, &"pbs".into(), &"n1".into()));
    assert_eq!(status["tasks"][1]["id"], "17[1].head");
    let (code, said) = site.said(&["remove", "pool"]);
    assert!(code == 0 && said.contains("is cancelled, nothing is left"), "{said}");
    assert_eq!(std::fs::read_to_string(site.path("deleted")).unwrap(), "17[].head\n");
    let (code, said) = site.said(&["remove", "pool"]);
    assert!(code == 0 && said.contains("nothing is left"), "a second time: {said}");
}

#[test]
fn one_worker_is_a_job_and_no_array() {
    let site = pbs(RUNNING);
    let (code, said) = deploy(&site, &["--workers", "1"]);
    assert!(code == 0 && said.contains("1 of 1 run"), "{said}");
    let script = std::fs::read_to_string(site.path("pool/worker.pbs")).unwrap();
    assert!(!script.contains("-J") && script.contains("${NCPUS:-1}"), "{script}");
}

#[test]
fn a_queue_that_does_not_start_is_told_with_the_comment_of_pbs_and_since_when() {
    let waiting = "\\\"job_state\\\":\\\"Q\\\", \\\"eligible_time\\\":\\\"00:05:00\\\", \\\"comment\\\":\\\"Not Running: Insufficient amount of resource: ncpus\\\"";
    let site = pbs(waiting);
    let (code, said) = deploy(&site, &["--workers", "2"]);
    assert!(
        code == 0 && said.contains("the others wait: Not Running: Insufficient amount of resource: ncpus"),
        "{said}"
    );
    let (_, json) = site.said(&["status", "pool", "--json"]);
    let status: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(
        (&status["tasks"][0]["state"], &status["tasks"][0]["since"]),
        (&"waiting".into(), &700.into())
    );
}

#[test]
fn what_pbs_refuses_and_what_a_deployment_sets_itself_is_told_and_nothing_is_left() {
    let cases: [(&[&str], &str); 6] = [
        (&["--workers", "2", "--", "-q", "nowhere"], "qsub refused the submission: qsub: Unknown queue"),
        (&["--workers", "2", "--", "-A", "nobody"], "Invalid account"),
        (&["--workers", "2", "--", "-N", "mine"], "found by their name"),
        (&["--workers", "2", "--", "-J0-7"], "the number of tasks is that of --workers"),
        (&["--workers", "2", "--", "mine.sh"], "mine.sh cannot be given to qsub: a word that is no option"),
        (&["--workers", "2", "--", "-l"], "-l cannot be given to qsub: it needs a value"),
    ];
    for (options, words) in cases {
        let site = pbs(RUNNING);
        let (code, said) = deploy(&site, options);
        assert!(code == 2 && said.contains(words), "{options:?}: {code} {said}");
        assert!(!site.path("submitted").exists(), "{options:?}");
    }
    let (code, said) = deploy(&Site::new(), &["--workers", "2"]);
    assert!(
        code == 2 && said.contains("there is no program `qsub` on this machine, which PBS has"),
        "{said}"
    );
}

#[test]
fn an_array_that_dies_at_once_is_an_error_with_its_last_lines() {
    let site = pbs("\\\"job_state\\\":\\\"X\\\", \\\"Exit_status\\\":2");
    let qsub = std::fs::read_to_string(site.path("bin/qsub")).unwrap();
    let site = site.program(
        "qsub",
        &format!("for i in 0 1; do echo 'node n1 says: no such library' > $SITE/pool/logs/worker-$i.log; done\n{qsub}"),
    );
    let (code, said) = deploy(&site, &["--workers", "2"]);
    assert!(code == 2 && said.contains("all 2 tasks died at once (ended with exit code 2)"), "{said}");
    assert!(said.contains("no such library") && site.path("deleted").exists(), "{said}");
}
