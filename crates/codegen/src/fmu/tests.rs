use super::*;
use crate::c::project;
use stickslip_core::control::Pid;
use stickslip_core::friction::Stribeck;

fn of_pid(version: Version) -> Fmu {
    let pid = Pid::<f64>::default();
    fmu(&project::<_, f64>(&pid, "pid", 1e-3).expect("a valid name in C"), "pid", 1e-3, version, None)
}

fn text<'a>(fmu: &'a Fmu, name: &str) -> &'a str {
    &fmu.files.iter().find(|file| file.0 == name).expect("the FMU has it").1
}

#[test]
fn a_variable_has_its_unit_range_value_and_description() {
    for (version, start) in [(Version::Two, "<ScalarVariable"), (Version::Three, "<Float64")] {
        let fmu = of_pid(version);
        let xml = text(&fmu, "modelDescription.xml");
        let line = xml.lines().find(|line| line.contains("\"parameters.")).expect("a controller has parameters");
        assert!(line.trim().starts_with(start), "{line}");
        for word in
            ["causality=\"parameter\"", "variability=\"tunable\"", "unit=", "min=", "max=", "start=", "description="]
        {
            assert!(line.contains(word), "{word}: {line}");
        }
        let references: Vec<usize> = xml
            .lines()
            .filter(|line| line.trim().starts_with(start))
            .filter_map(|line| line.split("valueReference=\"").nth(1)?.split('"').next()?.parse().ok())
            .filter(|reference| *reference > 0)
            .collect();
        assert_eq!(references, (1..=references.len()).collect::<Vec<_>>());
        assert!(text(&fmu, "sources/model.h").contains(&format!("#define FMU_COUNT {}U", references.len())));
    }
}

#[test]
fn library_and_description_have_the_same_token_and_other_models_another() {
    let two = of_pid(Version::Two);
    let header = text(&two, "sources/model.h");
    let token = header.split("FMU_TOKEN \"").nth(1).and_then(|rest| rest.split('"').next()).expect("it has one");
    assert_eq!(token.len(), 38);
    assert!(text(&two, "modelDescription.xml").contains(&format!("guid=\"{token}\"")));
    assert!(!text(&of_pid(Version::Three), "sources/model.h").contains(token));
    let other = Pid::<f64> { proportional_gain: 0.125, ..Pid::default() };
    let other = fmu(&project::<_, f64>(&other, "pid", 1e-3).expect("a name"), "pid", 1e-3, Version::Two, None);
    assert!(!text(&other, "sources/model.h").contains(token));
}

#[test]
fn a_block_without_state_has_none_in_c() {
    let curve = Stribeck::<f64>::default();
    let curve_fmu =
        fmu(&project::<_, f64>(&curve, "curve", 1e-3).expect("a name"), "curve", 1e-3, Version::Three, None);
    let header = text(&curve_fmu, "sources/model.h");
    assert!(
        !header.contains("curve_state") && header.contains("curve_step(&model->p, &model->in, FMU_STEP, &model->out)")
    );
}

#[test]
fn texts_of_a_field_cannot_end_an_attribute() {
    assert_eq!(description::escape("a < \"b\" & c"), "a &lt; &quot;b&quot; &amp; c");
}

fn service() -> Service {
    Service { address: std::net::Ipv4Addr::LOCALHOST.into(), port: 5555, epk: "a \"pid\"".into(), cycle: (1, 6) }
}

fn served(version: Version) -> Fmu {
    let pid = Pid::<f64>::default();
    fmu(&project::<_, f64>(&pid, "pid", 1e-3).expect("a valid name in C"), "pid", 1e-3, version, Some(&service()))
}

#[test]
fn an_fmu_with_xcp_states_it_and_has_its_options() {
    for (version, causality) in [(Version::Two, "\"parameter\""), (Version::Three, "\"structuralParameter\"")] {
        let fmu = served(version);
        let manifest = text(&fmu, &format!("{FOLDER}/fmi-ls-manifest.xml"));
        assert!(manifest.contains("definition=\"pid.a2l\"") && manifest.contains("containsXCPService=\"true\""));
        let xml = text(&fmu, "modelDescription.xml");
        // Each role is that of an existing variable, fixed and with a start.
        let roles = manifest.lines().filter(|line| line.contains("role="));
        let names: Vec<&str> = roles.filter_map(|line| line.split("name=\"").nth(1)?.split('"').next()).collect();
        assert_eq!(names.len(), Service::VARIABLES);
        for name in names {
            let line = xml.lines().find(|line| line.contains(&format!("name=\"{name}\""))).expect(name);
            assert!(
                line.contains(&format!("causality={causality}")) && line.contains("variability=\"fixed\""),
                "{line}"
            );
        }
        assert!(text(&fmu, "sources/model.h").contains("#define FMU_XCP_EPK \"a \\\"pid\\\"\""));
    }
    assert!(text(&served(Version::Three), "sources/buildDescription.xml").contains("compilerOptions=\"-pthread\""));
    assert!(!text(&of_pid(Version::Two), "sources/model.h").contains("XCP"));
}

/// Writes the sources of an FMU into a folder, with a program that includes them.
fn unpacked(fmu: &Fmu, program: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::create_dir(folder.path().join("sources")).expect("an empty folder");
    let sources = fmu.files.iter().filter(|(name, _)| name.starts_with("sources/"));
    for (name, text) in sources.map(|(name, text)| (name.as_str(), text.as_str())).chain([("main.c", program)]) {
        std::fs::write(folder.path().join(name), text).expect("the folder takes files");
    }
    folder
}

#[test]
fn steps_are_counted_however_the_importer_computes_its_time() {
    // The time as start + k·h, as t += h, and with the difference of two times as the length.
    let program = r#"
#include "sources/fmi2.c"

static void print_report(const void *importer, const char *name, int serious, const char *message) {
    (void)importer; (void)name; (void)serious;
    fprintf(stderr, "%s\n", message);
}

int main(void) {
    const double starts[] = {0.0, 1e6, -3e7}, lengths[] = {FMU_STEP, FMU_STEP / 3.0, 0.1 * FMU_STEP, 2.5 * FMU_STEP};
    uint32_t input = 1U;
    int a, b, way, k;
    while (FMU_VARIABLES[input - 1U].kind != FMU_INPUT) {
        input++;
    }
    for (a = 0; a < 3; a++) {
        for (b = 0; b < 4; b++) {
            const double start = starts[a], h = lengths[b];
            fmu_instance *instances[3];
            double added = start;
            for (way = 0; way < 3; way++) {
                instances[way] = fmu_new("pid");
                instances[way]->report = print_report;
                (void)fmu_begin(instances[way], start);
                instances[way]->memory.phase = FMU_STEPPING;
            }
            for (k = 0; k < 20000; k++) {
                const double now = start + k * h, next = start + (k + 1) * h;
                const double points[] = {now, added, now}, spans[] = {h, h, next - now};
                for (way = 0; way < 3; way++) {
                    const double value = ((k / 40) % 2) ? 1.0 : -1.0;
                    if (!fmu_set(instances[way], &input, 1, &value) || !fmu_do_step(instances[way], points[way], spans[way])) {
                        return 2;
                    }
                    if ((instances[way]->memory.steps != instances[0]->memory.steps) ||
                        (memcmp(&instances[0]->memory.model, &instances[way]->memory.model, sizeof(fmu_model)) != 0)) {
                        fprintf(stderr, "start %g, length %g steps, row %d, way %d\n", start, h / FMU_STEP, k, way);
                        return 1;
                    }
                }
                added += h;
            }
            /* Every step has been taken, and the last one on time. */
            if (instances[1]->memory.steps != (uint64_t)floor(20000.0 * (h / FMU_STEP) + 1e-6)) {
                fprintf(stderr, "%g steps\n", (double)instances[1]->memory.steps);
                return 3;
            }
        }
    }
    return 0;
}
"#;
    let pid = Pid::<f64>::default();
    let fmu = fmu(&project::<_, f64>(&pid, "pid", 1e-4).expect("a name"), "pid", 1e-4, Version::Two, None);
    let folder = unpacked(&fmu, program);
    let run = |command: &mut std::process::Command| {
        let output = command.current_dir(folder.path()).output().expect("a C compiler, and its program");
        assert!(output.status.success(), "{:?}: {}", output.status, String::from_utf8_lossy(&output.stderr));
    };
    run(std::process::Command::new("cc").args(["-std=c99", "-O1", "-o", "main", "main.c", "-lm"]));
    run(&mut std::process::Command::new(folder.path().join("main")));
}

#[test]
fn the_sources_compile_without_a_warning_with_the_service_and_without() {
    for fmu in [Version::Two, Version::Three].map(|version| [of_pid(version), served(version)]).into_iter().flatten() {
        let folder = unpacked(&fmu, "");
        let output = std::process::Command::new("cc")
            .args([
                "-std=c99",
                "-O2",
                "-Wall",
                "-Wextra",
                "-Wpedantic",
                "-Wconversion",
                "-Wno-sign-conversion",
                "-Werror",
            ])
            .args(["-fPIC", "-shared", "-pthread", "-o", "library"])
            .args(&fmu.sources)
            .current_dir(folder.path())
            .output()
            .expect("a C compiler");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
}
