//! `starlings deploy watch` lets the number of workers follow the work. Under a real Slurm: tests/slurm_elastic.rs.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod access_kit;
mod common;
mod deploy_kit;

use access_kit::{Started, worker};
use common::studies::slow;
use common::{starlings, wait_until};
use deploy_kit::Site;
use serde_json::{Value, json};

/// A Slurm in which no task ever starts: what was submitted and not cancelled is in the queue, a file for each.
fn queue() -> Site {
    let sbatch = "for option; do case $option in --array=*) array=${option#--array=};; esac; done
IFS=,
for range in $array; do
  i=${range%-*}
  while [ $i -le ${range#*-} ]; do echo > $SITE/tasks/$i; i=$((i + 1)); done
done
echo $array >> $SITE/submitted
echo 7";
    let squeue = "for option; do case $option in --name=*) name=${option#--name=};; esac; done
name=${name%%,*}
cd $SITE/tasks
for i in *; do
  [ -e $i ] && echo \"7_$i |$i |PENDING | |100 |100 |100 |Priority |0 |0 |$name |\"
done
exit 0";
    let scancel = "for option; do case $option in
  --user=*) ;;
  --name=*) rm -f $SITE/tasks/*;;
  7_*) rm -f $SITE/tasks/${option#7_};;
  *) exit 1;;
esac; done";
    let site = Site::new().program("sbatch", sbatch).program("squeue", squeue).program("scancel", scancel);
    std::fs::create_dir(site.path("tasks")).unwrap();
    site
}

/// What a coordinator says of its work.
fn work(site: &Site, count: u64, ended: bool, unfinished: usize) {
    let text = json!({ "count": count, "ended": ended, "unfinished": unfinished, "workers": [] });
    // As the coordinator does it: a reader never sees a part.
    std::fs::write(site.path("new"), text.to_string()).unwrap();
    std::fs::rename(site.path("new"), site.path("pool/access.load")).unwrap();
}

#[test]
fn workers_are_added_for_a_queue_and_released_at_the_tail_and_both_is_kept_as_events() {
    let site = queue();
    let (code, said) = site.slurm(&["--elastic", "1..4", "--slots", "2"]);
    assert!(code == 0 && said.contains("submitted 1 worker as") && said.contains("1..4 workers"), "{said}");
    let arguments = ["watch", "pool", "--every", "0.1", "--release-after", "1s"];
    let mut watch = Started::of(&mut site.starlings(&arguments));
    work(&site, 1, false, 7);
    watch.await_words("3 workers added, 1 → 4: 7 runs without a result");
    work(&site, 2, false, 3);
    watch.await_words("2 workers released, 4 → 2: 3 runs without a result");
    let (_, status) = site.said(&["status", "pool", "--json"]);
    let status: Value = serde_json::from_str(&status).unwrap();
    let tasks: Vec<&str> =
        status["tasks"].as_array().unwrap().iter().map(|task| task["task"].as_str().unwrap()).collect();
    assert_eq!(tasks, ["worker 0", "worker 1"], "those that are not there are not told");
    work(&site, 3, false, 8);
    watch.await_words("2 workers added, 2 → 4: 8 runs without a result");
    work(&site, 4, true, 0);
    watch.await_words("3 workers released, 4 → 1: 0 runs without a result");
    assert_eq!(site.said(&["remove", "pool"]).0, 0);
    assert_eq!(watch.end(), Some(0), "{}", watch.said());

    assert_eq!(std::fs::read_to_string(site.path("submitted")).unwrap(), "0\n1-3\n2-3\n");
    let events = std::fs::read_to_string(site.path("pool/events.jsonl")).unwrap();
    let events: Vec<(String, u64, u64)> = events
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap())
        .map(|e| {
            (e["event"].as_str().unwrap().to_owned(), e["from"].as_u64().unwrap(), e["to"].as_u64().unwrap())
        })
        .collect();
    let expected = [
        ("workers-added", 1, 4),
        ("workers-released", 4, 2),
        ("workers-added", 2, 4),
        ("workers-released", 4, 1),
    ];
    assert_eq!(events, expected.map(|(event, from, to)| (event.to_owned(), from, to)));
}

#[test]
fn a_pool_that_may_be_empty_waits_for_its_coordinator_and_ends_after_it() {
    let site = queue();
    let (code, said) = site.slurm(&["--elastic", "0..2"]);
    assert!(code == 0 && said.contains("submitted 0 workers"), "{said}");
    assert!(!site.path("submitted").exists());
    let arguments = ["watch", "pool", "--every", "0.1", "--release-after", "1s"];
    let mut watch = Started::of(&mut site.starlings(&arguments));
    work(&site, 1, false, 9);
    watch.await_words("2 workers added, 0 → 2");
    work(&site, 2, true, 0);
    watch.await_words("2 workers released, 2 → 0");
    assert_eq!(watch.end(), Some(0), "{}", watch.said());
    assert!(watch.said().contains("no process is left"), "{}", watch.said());
}

#[test]
fn a_pool_that_is_removed_is_not_filled_again_by_whoever_watches_it() {
    let site = queue();
    assert_eq!(site.slurm(&["--elastic", "1..4"]).0, 0);
    let mut watch = Started::of(&mut site.starlings(&["watch", "pool", "--every", "0.1"]));
    work(&site, 1, false, 3);
    watch.await_words("2 workers added, 1 → 3");
    // The coordinator still has work.
    let (code, said) = site.said(&["remove", "pool"]);
    assert!(code == 0 && said.contains("nothing is left"), "{said}");
    assert_eq!(watch.end(), Some(0), "{}", watch.said());
    assert_eq!(std::fs::read_to_string(site.path("submitted")).unwrap(), "0\n1-2\n");
}

#[test]
fn a_coordinator_tells_its_work_where_a_deployment_asks_for_that_and_in_the_end_that_it_has_ended() {
    let folder = tempfile::tempdir().unwrap();
    let study = slow(folder.path(), 2);
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("access.load"), "").unwrap();
    let told = || -> Value {
        let text = std::fs::read_to_string(path("access.load")).unwrap();
        serde_json::from_str(&text).unwrap_or_default()
    };
    let mut call = starlings();
    call.arg("run").arg(&study).args(["--listen", "127.0.0.1:0", "--access"]).arg(path("access.json"));
    let mut coordinator = Started::of(call.arg("--out").arg(path("run")));
    coordinator.await_words("listening on ");
    let mut worker = worker(&path("access.json"), &[]);
    let own = format!("/{}", worker.child.id());
    wait_until("a worker with runs", || {
        let told = told();
        let named = told["workers"][0]["name"]
            .as_str()
            .is_some_and(|name| name.starts_with("1@") && name.ends_with(&own));
        named
            && told["unfinished"].as_u64() > Some(0)
            && told["workers"][0]["slots"] == 1
            && told["ended"] == false
    });
    assert_eq!(coordinator.end(), Some(0), "{}", coordinator.said());
    assert_eq!((&told()["ended"], &told()["unfinished"]), (&true.into(), &0.into()));
    assert_eq!(worker.end(), Some(0), "{}", worker.said());
}
