//! Licences of the dependencies: permissive ones only.

use serde_json::Value;
use spdx::{Expression, ParseMode};

/// Licences that require only their text and a name. Copyleft licences are not allowed.
const ALLOWED: [&str; 10] =
    ["0BSD", "Apache-2.0", "BSD-2-Clause", "BSD-3-Clause", "BSL-1.0", "CC0-1.0", "ISC", "MIT", "Unicode-3.0", "Zlib"];

/// `Err` with a line for each package of `cargo metadata` whose licence is not allowed.
pub(crate) fn check(metadata: &Value) -> Result<(), String> {
    let packages = metadata["packages"].as_array().ok_or("cargo metadata lists no packages")?;
    let refused: Vec<String> = packages.iter().filter_map(refusal).collect();
    if refused.is_empty() { Ok(()) } else { Err(refused.join("\n")) }
}

/// The reason why a package is not allowed.
fn refusal(package: &Value) -> Option<String> {
    let name = package["name"].as_str().unwrap_or("a package without name");
    let Some(licence) = package["license"].as_str() else {
        return Some(format!("{name} has no licence; use another package"));
    };
    // Lax: older packages write a choice as `MIT/Apache-2.0`.
    let Ok(expression) = Expression::parse_mode(licence, ParseMode::LAX) else {
        return Some(format!("{name} has the licence \"{licence}\", an invalid SPDX expression"));
    };
    // An exception (`WITH …`) only adds permissions.
    let allowed = expression.evaluate(|part| part.license.id().is_some_and(|id| ALLOWED.contains(&id.name)));
    (!allowed).then(|| format!("{name} has the licence \"{licence}\"; allowed are {}", ALLOWED.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check_licence(licence: &str) -> Result<(), String> {
        check(&serde_json::json!({ "packages": [{ "name": "peer", "license": licence }] }))
    }

    #[test]
    fn permissive_licences_and_choices_that_include_one_are_allowed() {
        for licence in
            ["MIT", "MIT OR Apache-2.0", "MIT/Apache-2.0", "GPL-2.0-only OR MIT", "(MIT OR Zlib) AND BSD-3-Clause"]
        {
            assert_eq!(check_licence(licence), Ok(()), "{licence}");
        }
        assert_eq!(check_licence("Apache-2.0 WITH LLVM-exception OR MIT"), Ok(()));
    }

    #[test]
    fn copyleft_alone_or_together_with_a_permissive_licence_is_refused() {
        for licence in
            ["GPL-3.0-only", "GPL-3.0-or-later", "MIT AND GPL-2.0-only", "MPL-2.0", "LGPL-2.1-only", "AGPL-3.0-only"]
        {
            let refusal = check_licence(licence).expect_err(licence);
            assert!(refusal.starts_with(&format!("peer has the licence \"{licence}\"; allowed are 0BSD")), "{refusal}");
        }
    }

    #[test]
    fn a_missing_or_invalid_licence_is_refused() {
        assert!(check_licence("free as in beer").is_err());
        assert!(check(&serde_json::json!({ "packages": [{ "name": "peer", "license": null }] })).is_err());
        assert!(check(&serde_json::json!({})).is_err());
    }
}
