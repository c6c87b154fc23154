//! Text for tools that read only ASCII: ASAP2 files before 1.7 and service texts.

/// The text with each letter beyond ASCII spelled out; letters without a spelling become `?`.
pub fn ascii(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        if letter.is_ascii() {
            // A line end within a string ends it for some readers.
            out.push(if letter.is_ascii_control() { ' ' } else { letter });
        } else {
            out.push_str(spelled(letter));
        }
    }
    out
}

fn spelled(letter: char) -> &'static str {
    match letter {
        'α' => "alpha",
        'β' => "beta",
        'γ' => "gamma",
        'δ' => "delta",
        'ε' => "epsilon",
        'ζ' => "zeta",
        'η' => "eta",
        'θ' | 'ϑ' => "theta",
        'κ' => "kappa",
        'λ' => "lambda",
        'μ' | 'µ' => "mu",
        'ν' => "nu",
        'ξ' => "xi",
        'π' => "pi",
        'ρ' => "rho",
        'σ' => "sigma",
        'τ' => "tau",
        'φ' | 'ϕ' => "phi",
        'ψ' => "psi",
        'ω' => "omega",
        'ẋ' => "x_dot",
        'ṙ' => "r_dot",
        'ż' => "z_dot",
        'Δ' => "Delta",
        'Ω' => "Omega",
        '₀' | '⁰' => "0",
        '₁' | '¹' => "1",
        '₂' | '²' => "2",
        '₃' | '³' => "3",
        '₄' => "4",
        '⁻' | '−' | '–' => "-",
        '√' => "sqrt ",
        '·' | '×' => "*",
        '…' => "...",
        '±' => "+-",
        '≤' => "<=",
        '≥' => ">=",
        '∞' => "inf",
        '°' => "deg",
        '\u{307}' => "_dot",
        '\u{308}' => "_ddot",
        '’' => "'",
        '“' | '”' => "\"",
        _ => "?",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symbols_and_units_are_spelled_out() {
        assert_eq!(ascii("σ₀ = 3 N m √Hz\n…"), "sigma0 = 3 N m sqrt Hz ...");
        assert_eq!(ascii("鉄"), "?");
    }
}
