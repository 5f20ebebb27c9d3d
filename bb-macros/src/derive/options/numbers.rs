//! Numbers in defaults and ranges: their value, and whether they are of the option's kind.

use crate::diagnostics::Diagnostics;
use quote::ToTokens;
use syn::{Expr, ExprUnary, Lit, Type, UnOp};

/// Reports a literal of another kind than the option's; rustc would point at the derive or say less.
pub(super) fn check_number(number: &Expr, kind: &Type, diagnostics: &mut Diagnostics) {
    let Type::Path(path) = kind else { return };
    let Some(kind) = path.path.segments.last().map(|segment| segment.ident.to_string()) else { return };
    let Some(literal) = literal(number) else { return };
    let is_float = matches!(&*kind, "f64" | "f32");
    let is_integer = ["i8", "i16", "i32", "i64", "u8", "u16", "u32", "u64", "usize", "isize"].contains(&&*kind);
    let text = plain(number);
    let message = match literal {
        Lit::Int(digits) if is_float && digits.suffix().is_empty() => {
            format!("this option is an `{kind}`; write `{text}.0`")
        }
        Lit::Float(digits) if is_integer && digits.suffix().is_empty() => {
            let article = if kind.starts_with('i') { "an" } else { "a" };
            let whole = text.split('.').next().unwrap_or(&text);
            format!("this option is {article} `{kind}`; write a whole number, as in `{whole}`")
        }
        Lit::Int(_) | Lit::Float(_) if kind == "Duration" => {
            "this option is a `Duration`, not a number; write `Duration::from_millis(100)`".to_owned()
        }
        Lit::Str(_) if is_float || is_integer => {
            let example = if is_float { "1.0" } else { "1" };
            format!("this option is a number; write one in SI, as in `{example}`")
        }
        _ => return,
    };
    diagnostics.error(number, message);
}

/// The number of a literal, with or without a minus sign.
pub(super) fn literal_number(expression: &Expr) -> Option<f64> {
    let sign = if matches!(expression, Expr::Unary(_)) { -1.0 } else { 1.0 };
    match literal(expression)? {
        Lit::Int(number) => number.base10_parse::<f64>().ok().map(|number| sign * number),
        Lit::Float(number) => number.base10_parse::<f64>().ok().map(|number| sign * number),
        _ => None,
    }
}

/// A literal, with or without a minus sign.
fn literal(expression: &Expr) -> Option<&Lit> {
    match expression {
        Expr::Unary(ExprUnary { op: UnOp::Neg(_), expr, .. }) => match &**expr {
            Expr::Lit(literal) => Some(&literal.lit),
            _ => None,
        },
        Expr::Lit(literal) => Some(&literal.lit),
        _ => None,
    }
}

/// The text of an expression without the whitespace between its tokens.
pub(super) fn plain(expression: &Expr) -> String {
    expression.to_token_stream().to_string().replace(' ', "")
}
