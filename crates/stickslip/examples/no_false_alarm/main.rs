//! False alarms in an hour of bench time without faults.

mod scenarios;

use scenarios::{Case, run};
use stickslip::LawChoice;

/// Bench time [s].
const HOUR: f64 = 3600.0;

fn main() {
    let (mut time, mut alarms, mut refused) = (0.0, Vec::new(), 0);
    for seed in 1.. {
        for preset in ["clm-bench", "clm-real", "clm-soft"] {
            for tick_rate in [1000.0, 4000.0] {
                for law in [LawChoice::Paper, LawChoice::Bristle] {
                    match run(Case { preset, tick_rate, law, seed }) {
                        Ok((passed, raised)) => {
                            time += passed;
                            raised.iter().for_each(|alarm| println!("{alarm}"));
                            alarms.extend(raised);
                        }
                        Err(error) => {
                            refused += 1;
                            eprintln!("{preset}, {tick_rate} Hz: {error}");
                        }
                    }
                }
            }
        }
        if time >= HOUR {
            break;
        }
    }
    println!("{} false alarms in {time:.0} s of bench time ({refused} cases refused by design)", alarms.len());
}
