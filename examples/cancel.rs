//! Measures how soon a sequence ends that is stopped at once, in every stage.
//! `cargo run --release --example cancel PLAN.toml [TIMES]`: runs the plan's first scan to its end, then stops it TIMES (8) times in every
//! stage, evenly spread over it, and prints the longest wait of each. Nothing of the plan's results is touched.

use shapeline::part::cache_path;
use shapeline::run::Stage;
use shapeline::worker::{Event, SequenceJob, SequenceRequest, StopSwitch};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

/// One stay in a stage; a scan may enter a stage twice.
type Stay = (Stage, Duration);

/// A job that was stopped: in which stage, and how long its end took.
struct Stopped {
    stage: Stage,
    waited: Duration,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args_os().skip(1);
    let plan = PathBuf::from(arguments.next().ok_or("give a plan")?);
    let times: u32 = arguments.next().map_or(Ok(8), |n| n.to_string_lossy().parse())?;
    let loaded = shapeline::plan::load(&plan);
    let cad = cache_path(&loaded.plan.ok_or("the plan has problems; see `shapeline check`")?.cad.path);

    let stays = run_whole(&plan, &cad)?;
    let mut stopped = Vec::new();
    for (index, (stage, length)) in stays.iter().enumerate() {
        for k in 0..times {
            let after = length.mul_f64((f64::from(k) + 0.5) / f64::from(times));
            if *stage == Stage::Prepare {
                forget(&cad)?;
            }
            stopped.extend(stop_in(&plan, index, after)?);
        }
    }
    print_table(&stays, &stopped);
    Ok(())
}

/// Removes the prepared CAD, so that it is made again.
fn forget(cache: &Path) -> std::io::Result<()> {
    match std::fs::remove_file(cache) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(e),
        _ => Ok(()),
    }
}

fn request(plan: &Path, out: &Path) -> SequenceRequest {
    SequenceRequest { plan_path: plan.to_path_buf(), out: Some(out.to_path_buf()), ..SequenceRequest::default() }
}

/// The stages of the first scan and how long each takes, the CAD prepared anew.
fn run_whole(plan: &Path, cache: &Path) -> Result<Vec<Stay>, Box<dyn Error>> {
    forget(cache)?;
    let out = tempfile::tempdir()?;
    let stop = StopSwitch::default();
    let job = SequenceJob::start(request(plan, out.path()), stop.clone(), || {})?;
    let mut stays: Vec<Stay> = Vec::new();
    let mut entered = Instant::now();
    for event in &job.events {
        if !matches!(event, Event::Stage(_) | Event::Finished { .. }) {
            continue;
        }
        if let Some(last) = stays.last_mut() {
            last.1 = entered.elapsed();
        }
        entered = Instant::now();
        match event {
            Event::Stage(stage) => stays.push((stage, Duration::ZERO)),
            _ => break,
        }
    }
    stop.now.cancel();
    job.events.iter().for_each(drop);
    job.join();
    Ok(stays)
}

/// Stops the job so long after it has entered its stage number `index`; `None` when it was done before.
fn stop_in(plan: &Path, index: usize, after: Duration) -> Result<Option<Stopped>, Box<dyn Error>> {
    let out = tempfile::tempdir()?;
    let stop = StopSwitch::default();
    let job = SequenceJob::start(request(plan, out.path()), stop.clone(), || {})?;
    let (mut seen, mut stage, mut due) = (0, Stage::Prepare, None::<Instant>);
    let finished = loop {
        let event = match due {
            None => job.events.recv().map_err(RecvTimeoutError::from),
            Some(due) => job.events.recv_timeout(due.saturating_duration_since(Instant::now())),
        };
        match event {
            Ok(Event::Stage(entered)) => {
                stage = entered;
                if seen == index {
                    due = Some(Instant::now() + after);
                }
                seen += 1;
            }
            Ok(Event::Finished { .. }) | Err(RecvTimeoutError::Disconnected) => break true,
            Ok(_) => {}
            Err(RecvTimeoutError::Timeout) => break false,
        }
    };
    let asked = Instant::now();
    stop.now.cancel();
    job.events.iter().for_each(drop);
    job.join();
    Ok((!finished).then(|| Stopped { stage, waited: asked.elapsed() }))
}

#[allow(clippy::print_stdout, reason = "the table is what this program is for")]
fn print_table(stays: &[Stay], stopped: &[Stopped]) {
    let mut stages: Vec<Stage> = stays.iter().map(|(stage, _)| *stage).collect();
    stages.sort();
    stages.dedup();
    println!("| stage | takes, s | stopped, times | longest wait, s |\n|---|---|---|---|");
    for stage in stages {
        let takes: f64 = stays.iter().filter(|(s, _)| *s == stage).map(|(_, t)| t.as_secs_f64()).sum();
        let waits: Vec<f64> = stopped.iter().filter(|s| s.stage == stage).map(|s| s.waited.as_secs_f64()).collect();
        let longest = waits.iter().fold(0.0f64, |a, b| a.max(*b));
        println!("| {} | {takes:.2} | {} | {longest:.2} |", stage.words(), waits.len());
    }
}
