//! Writes what the fuzzer starts from: one message of each kind and the files of the examples, a folder of the corpus per target.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use prost::Message;
use starlings_models::{
    Description, Job, ModelFailure, ObserverDef, ParticleError, Prediction, Quantity, Run, Setup, Solved,
    Spec, Timeout, Window,
};
use starlings_proto::access::{AccessFile, Token};
use starlings_proto::convert::lent::{GiveBack, Lend, encode_in_memory};
use starlings_proto::convert::piece_names::encode_names;
use starlings_proto::convert::solver::description::encode_description;
use starlings_proto::convert::solver::{Reply, encode_reply, encode_run};
use starlings_proto::convert::state::{
    CHUNK_VALUES, Get, PutHead, encode_chunk, encode_head, encode_put_result,
};
use starlings_proto::convert::{HeldRun, ended};
use starlings_proto::{
    Bytes, FromWorker, Hello, JobEncoder, Lease, LeaseOutcome, PROTOCOL, SentWindows, State, ToWorker,
    VERSION, Welcome, encode_setup,
};

const LEASE: Lease = Lease { epoch: 1, job: 7, attempt: 1 };

fn main() -> Result<(), Box<dyn std::error::Error>> {
    messages()?;
    texts()?;
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    for (target, ending) in [("study", "toml"), ("recording", "csv"), ("mesh", "off"), ("template", "tmpl")] {
        for (i, file) in
            files(&examples)?.iter().filter(|file| file.extension().is_some_and(|e| e == ending)).enumerate()
        {
            let content = std::fs::read(file)?;
            // A long one teaches the fuzzer nothing more and slows it down.
            write(target, &format!("example-{i}"), &content[..content.len().min(20_000)])?;
        }
    }
    let imported = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/import_files");
    for (target, ending) in [("svzerodsolver", "json"), ("openbf", "yaml")] {
        for (i, file) in files(&imported.join(target))?.iter().enumerate() {
            if file.extension().is_some_and(|e| e == ending) {
                write(target, &format!("network-{i}"), &std::fs::read(file)?)?;
            }
        }
    }
    Ok(())
}

/// All files below a folder, in order.
fn files(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() { found.extend(files(&path)?) } else { found.push(path) }
    }
    found.sort();
    Ok(found)
}

fn write(target: &str, name: &str, bytes: &[u8]) -> std::io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(target);
    std::fs::create_dir_all(&folder)?;
    std::fs::write(folder.join(name), bytes)
}

/// One message of each kind that travels.
fn messages() -> Result<(), Box<dyn std::error::Error>> {
    from_worker()?;
    to_worker()?;
    transfers()?;
    solver()
}

/// What a worker says, and how its runs ended.
fn from_worker() -> Result<(), Box<dyn std::error::Error>> {
    let hello = Hello {
        protocol: PROTOCOL,
        version: VERSION.to_owned(),
        cores: 4,
        slots: 2,
        host: "node7".to_owned(),
        pid: 812,
        nonce: 42,
        build: Some([3; 32]),
    };
    let prediction = Prediction { outputs: vec![1.0, f64::NAN], state: State::Values(vec![0.5]), cost: 0.01 };
    let late = Timeout { limit: 2.0, says: "too late".to_owned() };
    let step = ModelFailure::StepTooSmall { time: 0.5, step: 1e-13 };
    let outcomes = [
        Ok(prediction.clone()),
        Ok(Prediction { state: State::Named([7; 32]), ..prediction }),
        Err(ParticleError::from(late)),
        Err(step.into()),
        Err(ParticleError::Infrastructure("no licence".to_owned())),
        Err(ParticleError::Undecided("signal 11".to_owned())),
    ];
    let kept = Bytes::from(ended::encode(&outcomes[0], 0.01));
    let mut from_worker = vec![
        FromWorker::Hello(hello),
        FromWorker::Setup { id: [1; 32], result: Ok(()) },
        FromWorker::Setup { id: [1; 32], result: Err("no such model".to_owned()) },
        FromWorker::Result { lease: LEASE, answer: LeaseOutcome::Withdrawn, cost: 0.0 },
        FromWorker::Heartbeat { running: 1, queued: 2 },
        FromWorker::Goodbye("ctrl-c".to_owned()),
        FromWorker::Held(vec![
            HeldRun { key: [9; 32], ended: Some(kept) },
            HeldRun { key: [8; 32], ended: None },
        ]),
    ];
    for (i, outcome) in outcomes.into_iter().enumerate() {
        write("kept_run", &format!("end-{i}"), &ended::encode(&outcome, 0.25))?;
        from_worker.push(FromWorker::Result { lease: LEASE, answer: LeaseOutcome::Ran(outcome), cost: 0.25 });
    }
    from_worker.push(FromWorker::SharesStates);
    for made in [Ok(vec![[1; 32], [2; 32]]), Err("no room".to_owned())] {
        from_worker.push(FromWorker::Recombined { lease: LEASE, made });
    }
    for (i, message) in from_worker.into_iter().enumerate() {
        write("from_worker", &format!("kind-{i}"), &message.encode()?.encode_to_vec())?;
    }
    Ok(())
}

/// The way of a large state.
fn transfers() -> Result<(), Box<dyn std::error::Error>> {
    let get = Get { epoch: 1, nonce: 42, state: [7; 32], names: true, descriptor: 3 };
    write("state_transfer", "get", &get.encode().encode_to_vec())?;
    write("state_transfer", "answer", &encode_put_result(&[7; 32]).encode_to_vec())?;
    let head = PutHead { n_state: 3, lease: LEASE, nonce: 42 };
    write("state_transfer", "head", &head.encode().encode_to_vec())?;
    let lend = Lend { head, descriptor: 5 };
    write("state_transfer", "lend", &lend.encode().encode_to_vec())?;
    let back = GiveBack { epoch: 1, nonce: 42, descriptor: 5 };
    write("state_transfer", "give-back", &back.encode().encode_to_vec())?;
    let mut lent = encode_head(CHUNK_VALUES + 1).encode_length_delimited_to_vec();
    lent.extend(encode_in_memory(5).encode_length_delimited_to_vec());
    write("state_transfer", "in-memory", &lent)?;
    let mut stream = encode_head(CHUNK_VALUES + 1).encode_length_delimited_to_vec();
    stream.extend(encode_chunk(vec![0; 8 * CHUNK_VALUES].into()).encode_length_delimited_to_vec());
    stream.extend(encode_chunk(vec![0; 8].into()).encode_length_delimited_to_vec());
    write("state_transfer", "stream", &stream)?;
    let mut named = encode_head(CHUNK_VALUES + 1).encode_length_delimited_to_vec();
    named.extend(encode_names(&[[1; 32], [2; 32]]).encode_length_delimited_to_vec());
    write("state_transfer", "names", &named)?;
    Ok(())
}

/// One stream with all that a coordinator says.
fn to_worker() -> Result<(), Box<dyn std::error::Error>> {
    let setup = Setup { parameters: vec!["R".to_owned()], outputs: vec!["p".to_owned()], ..Setup::default() };
    let (id, json) = encode_setup(&setup)?;
    write("setup", "default", &json)?;
    let window = |n: usize| {
        let times = (1..=n).map(|i| i as f64).collect();
        Arc::new(Window::free(0.0, times, 1, vec![]))
    };
    let welcome = Welcome {
        protocol: PROTOCOL,
        run: "pig".to_owned(),
        heartbeat: 5.0,
        epoch: 1,
        run_id: [5; 16],
        incarnation: 1,
        probe: Some([6; 32]),
    };
    let mut stream = vec![ToWorker::welcome(welcome), ToWorker::setup(&id, json)];
    let mut sent = SentWindows::default();
    // The second window is large enough to travel once, by name.
    for (particle, n) in [(0, 2), (1, 3000), (2, 3000)] {
        let state = Some(State::Values(vec![0.5]));
        let job = Job { particle, record: 0, window: window(n), theta: vec![1.0], state };
        let (ahead, job) = JobEncoder::of([&job]).encode(LEASE, &id, &job, &mut sent);
        stream.extend(ahead);
        stream.push(job);
    }
    stream.extend([
        ToWorker::cancel(&[LEASE], true),
        ToWorker::heartbeat(),
        ToWorker::adopt(&[([9; 32], LEASE)], true),
        ToWorker::notice("hear, hear"),
        ToWorker::recombine(LEASE, 3, &[[1; 32], [2; 32]], vec![0; 32].into()),
        ToWorker::drain("the run is over"),
        ToWorker::refuse("another version"),
    ]);
    let bytes: Vec<u8> = stream.iter().flat_map(Message::encode_length_delimited_to_vec).collect();
    write("to_worker", "stream", &bytes)?;
    for (i, message) in stream.iter().enumerate() {
        write("to_worker", &format!("kind-{i}"), &message.encode_length_delimited_to_vec())?;
    }
    Ok(())
}

/// What goes between a worker and a solver.
fn solver() -> Result<(), Box<dyn std::error::Error>> {
    let spec = Spec {
        states: vec![Quantity::new("x", "m").size(2)],
        parameters: vec![Quantity::new("k", "N/m")],
        outputs: vec![Quantity::new("tip", "m")],
        restart: true,
        ..Spec::default()
    };
    let description = Description {
        spec,
        name: "beam".to_owned(),
        deterministic: true,
        observers: vec!["nudging".to_owned()],
        hosts: vec!["x".to_owned()],
    };
    write("solver_description", "beam", &encode_description(&description).encode_to_vec())?;
    write("description_file", "beam", &serde_json::to_vec(&description)?)?;
    let window =
        Window { start: 0.0, times: vec![1.0, 2.0], observed: vec![0.1, 0.2], inputs: vec![], since: vec![] };
    let run = Run {
        particle: 1,
        record: 0,
        parameters: &[40.0],
        initial: &[("x".to_owned(), 0.1)],
        outputs: &["tip".to_owned()],
        window: &window,
        observer: &ObserverDef::default(),
        state: Some(&[0.0, 0.0]),
        terms: &[],
        constants: &[("c".to_owned(), 1.0)],
        stop: None,
        traceparent: Some("00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01"),
    };
    write("solver_request", "run", &encode_run(&run, "/tmp/scratch").encode_to_vec())?;
    let solved = Solved { outputs: vec![0.1, 0.2], state: vec![0.0, 0.0] };
    let late = ParticleError::Infrastructure("no licence".to_owned());
    for (i, reply) in
        [Reply::Progress(0.5), Reply::Ended(Ok(solved)), Reply::Ended(Err(late))].iter().enumerate()
    {
        write("solver_reply", &format!("kind-{i}"), &encode_reply(reply).encode_to_vec())?;
    }
    Ok(())
}

/// Files and texts that no example holds.
fn texts() -> Result<(), Box<dyn std::error::Error>> {
    let access = AccessFile::new("pig", vec!["node7:7000".to_owned()], "-----BEGIN", Token::of(&[1; 32]));
    write("access_file", "whole", &serde_json::to_vec(&access)?)?;
    write("expression", "all", b"a*exp(-b*t) + delay(x, 0.1) - if(x > 0, sqrt(x), 2^3)/max(1, y)")?;
    write("um_bridge_answer", "one", br#"{"output": [[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]]}"#)?;
    write("um_bridge_answer", "each", br#"{"output": [[1.0, 4.0], [2.0, null, 5.0, 6.0]]}"#)?;
    write(
        "template",
        "beam",
        b"*ELASTIC\n{{ E | fixed(3) }}, 0.3\n{% for t in times %}{{ t }}\n{% endfor %}",
    )?;
    write(
        "mesh",
        "tetrahedron",
        b"OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2\n3 0 1 3\n3 0 2 3\n3 1 2 3\n",
    )?;
    write("mesh", "stl", b"solid one\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n")?;
    write("mesh", "vtp", b"<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPolys=\"1\"><Points><DataArray type=\"Float32\" format=\"ascii\">0 0 0 1 0 0 0 1 0</DataArray></Points><Polys><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2</DataArray><DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">3</DataArray></Polys></Piece></PolyData></VTKFile>")?;
    write("recording", "three", b"t,flow,pressure\n0,1,90\n0.5,2,95\n1,1,91\n1.5,0,88\n")?;
    Ok(())
}
