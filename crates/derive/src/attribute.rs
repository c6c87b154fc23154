//! Contents of `#[field(…)]`, `#[fields(…)]` and the doc comment.

use quote::ToTokens;
use syn::{Attribute, Error, Expr, ExprLit, ExprPath, ExprUnary, Lit, LitStr, RangeLimits, Result, UnOp};

use crate::unit;

/// `#[field(…)]` of one number.
pub(crate) struct Number {
    pub(crate) symbol: String,
    pub(crate) unit: Option<LitStr>,
    pub(crate) range: (f64, f64),
    pub(crate) default: f64,
    pub(crate) kind: &'static str,
}

/// `#[fields(…)]` of a struct or enum.
#[derive(Default)]
pub(crate) struct Container {
    /// The relations between the fields.
    pub(crate) law: Option<ExprPath>,
    /// Checks that are not relations of two numbers.
    pub(crate) check: Option<ExprPath>,
    pub(crate) tag: Option<String>,
}

/// Reads `#[field(…)]`; `None` if there is none.
pub(crate) fn number(attributes: &[Attribute]) -> Result<Option<Number>> {
    let mut found = attributes.iter().filter(|a| a.path().is_ident("field"));
    let Some(attribute) = found.next() else { return Ok(None) };
    if let Some(second) = found.next() {
        return Err(Error::new_spanned(second, "duplicate #[field(…)]; use one for each field"));
    }
    let mut out = Number {
        symbol: String::new(),
        unit: None,
        range: (f64::NEG_INFINITY, f64::INFINITY),
        default: 0.0,
        kind: "Real",
    };
    let mut range_given_at = None;
    let mut default_given_at = None;
    attribute.parse_nested_meta(|meta| {
        if meta.path.is_ident("symbol") {
            out.symbol = meta.value()?.parse::<LitStr>()?.value();
        } else if meta.path.is_ident("unit") {
            let text: LitStr = meta.value()?.parse()?;
            unit::check(&text.value()).map_err(|message| Error::new(text.span(), message))?;
            out.unit = Some(text);
        } else if meta.path.is_ident("range") {
            let Expr::Range(range) = meta.value()?.parse()? else {
                return Err(meta.error("a range is two numbers: range = 0.0..=1.0"));
            };
            let (Some(low), Some(high), RangeLimits::Closed(_)) = (&range.start, &range.end, range.limits) else {
                return Err(Error::new_spanned(&range, "a range requires both ends, inclusive: 0.0..=1.0"));
            };
            out.range = (literal(low)?, literal(high)?);
            if out.range.0 > out.range.1 {
                return Err(Error::new_spanned(&range, "the range is empty: its low end is above its high end"));
            }
            range_given_at = Some(range.to_token_stream());
        } else if meta.path.is_ident("default") {
            let value: Expr = meta.value()?.parse()?;
            out.default = literal(&value)?;
            default_given_at = Some(value.to_token_stream());
        } else if meta.path.is_ident("whole") {
            out.kind = "Whole";
        } else if meta.path.is_ident("flag") {
            out.kind = "Flag";
        } else {
            return Err(
                meta.error("unknown key; a field has symbol, unit, range, default, whole, flag, or it is fixed")
            );
        }
        Ok(())
    })?;
    if out.kind == "Flag" {
        if let Some(range) = range_given_at {
            return Err(Error::new_spanned(range, "a flag is 0 or 1: remove the range"));
        }
        out.range = (0.0, 1.0);
    }
    let (low, high) = out.range;
    let problem = if out.kind != "Real" && out.default.fract() != 0.0 {
        format!("the default {} is not a whole number", out.default)
    } else if (low..=high).contains(&out.default) {
        return Ok(Some(out));
    } else if default_given_at.is_some() {
        format!("the default {:?} is outside the range {low:?} … {high:?}", out.default)
    } else {
        format!("the default 0 is outside the range {low:?} … {high:?}: state another default")
    };
    Err(Error::new_spanned(default_given_at.unwrap_or_else(|| attribute.to_token_stream()), problem))
}

/// Whether a field has `#[field(fixed)]`: configuration outside the signal path.
pub(crate) fn is_fixed(attributes: &[Attribute]) -> bool {
    let is_fixed = |a: &Attribute| a.parse_args::<syn::Ident>().is_ok_and(|word| word == "fixed");
    attributes.iter().filter(|a| a.path().is_ident("field")).any(is_fixed)
}

/// Reads `#[fields(…)]`.
pub(crate) fn container(attributes: &[Attribute]) -> Result<Container> {
    let mut out = Container::default();
    for attribute in attributes.iter().filter(|a| a.path().is_ident("fields")) {
        attribute.parse_nested_meta(|meta| {
            if meta.path.is_ident("law") {
                out.law = Some(meta.value()?.parse()?);
            } else if meta.path.is_ident("check") {
                out.check = Some(meta.value()?.parse()?);
            } else if meta.path.is_ident("tag") {
                out.tag = Some(meta.value()?.parse::<LitStr>()?.value());
            } else {
                return Err(meta.error("unknown key; fields has law and check (of a struct), tag (of an enum)"));
            }
            Ok(())
        })?;
    }
    Ok(out)
}

/// The doc comment as one line for each paragraph, separated by empty lines.
pub(crate) fn help(attributes: &[Attribute]) -> String {
    let mut text = String::new();
    for line in doc(attributes).lines().map(str::trim) {
        if line.is_empty() {
            text.push_str("\n\n");
        } else {
            if !text.is_empty() && !text.ends_with('\n') {
                text.push(' ');
            }
            text.push_str(line);
        }
    }
    text
}

/// The doc comment line by line.
pub(crate) fn doc(attributes: &[Attribute]) -> String {
    let mut lines = Vec::new();
    for attribute in attributes.iter().filter(|a| a.path().is_ident("doc")) {
        if let syn::Meta::NameValue(meta) = &attribute.meta
            && let Expr::Lit(ExprLit { lit: Lit::Str(line), .. }) = &meta.value
        {
            let line = line.value();
            lines.push(line.strip_prefix(' ').unwrap_or(&line).trim_end().to_string());
        }
    }
    lines.join("\n").trim().to_string()
}

/// A number literal, with or without a minus.
fn literal(expression: &Expr) -> Result<f64> {
    match expression {
        Expr::Lit(ExprLit { lit: Lit::Float(value), .. }) => value.base10_parse(),
        Expr::Lit(ExprLit { lit: Lit::Int(value), .. }) => value.base10_parse(),
        Expr::Unary(ExprUnary { op: UnOp::Neg(_), expr, .. }) => Ok(-literal(expr)?),
        other => Err(Error::new_spanned(other, "expected a number literal, which is also written to files and forms")),
    }
}
