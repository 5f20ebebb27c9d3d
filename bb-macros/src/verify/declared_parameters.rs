//! An option that starts with `param::` names a declared parameter, by its whole path.
//!
//! Right: `Madgwick(beta = param::imu::beta)` where `parameters` has `imu { beta: f64 = 0.1; }`
//! Wrong: `Madgwick(beta = param::imu::gain)`
//! Wrong: `Madgwick(beta = imu::beta)`
//! Wrong: `Madgwick(beta = 2.0 * param::imu::beta)`, since it is bound, not read

use crate::diagnostics::{Diagnostics, Place};
use crate::model::Robot;
use crate::names::{declare, nearest_path, some_of};
use crate::parse::OptionValue;
use proc_macro2::{Spacing, TokenStream, TokenTree};
use quote::ToTokens;
use syn::{Expr, ExprPath};

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    // Unread items may have declared the missing ones.
    if !robot.complete {
        return;
    }
    let known: Vec<String> = robot.parameters.iter().map(|parameter| parameter.path.join("::")).collect();
    for option in robot.components().flat_map(|component| &component.options) {
        let path = match &option.value {
            OptionValue::Parameter(path) => path,
            OptionValue::Expression { expression, .. } => {
                if let Some(path) = bare(expression, &known) {
                    let message = format!("a parameter is named by its whole path; write `{path}`");
                    diagnostics.error(expression, message);
                    continue;
                }
                if let Some(place) = inside(expression.to_token_stream()) {
                    let message = "an option is bound to a parameter as it is, and a parameter is not a value that can be \
                                   computed with; compute in the component, or declare a parameter of its own";
                    diagnostics.at(place, message.into());
                }
                continue;
            }
            OptionValue::Quantity(_) | OptionValue::Reference(_) => continue,
        };
        if robot.parameter(path).is_some() {
            continue;
        }
        let text = path.text();
        let inside: Vec<&str> = known
            .iter()
            .map(String::as_str)
            .filter(|known| known.strip_prefix(&text).is_some_and(|rest| rest.starts_with("::")))
            .collect();
        let message = if !inside.is_empty() {
            format!("`{text}` is a group of parameters; name one in it: {}", some_of(&inside))
        } else if let Some(near) = nearest_path(&text, &known) {
            format!("there is no parameter `{text}`; did you mean `{near}`?")
        } else {
            let known: Vec<&str> = known.iter().map(String::as_str).collect();
            format!("there is no parameter `{text}`; {}", declare(&known, "parameters"))
        };
        diagnostics.at(path.place(), message);
    }
}

/// The parameter that an expression names, without `param::`. Constants of Rust are in upper case.
fn bare<'a>(expression: &Expr, known: &'a [String]) -> Option<&'a String> {
    let Expr::Path(ExprPath { qself: None, path, .. }) = expression else { return None };
    let names: Vec<String> = path.segments.iter().map(|segment| crate::names::text(&segment.ident)).collect();
    let name = format!("param::{}", names.join("::"));
    known.iter().find(|parameter| **parameter == name)
}

/// The first path that starts with `param::` in an expression.
fn inside(expression: TokenStream) -> Option<Place> {
    let is_colon =
        |token: Option<&TokenTree>| matches!(token, Some(TokenTree::Punct(punct)) if punct.as_char() == ':');
    let tokens: Vec<TokenTree> = expression.into_iter().collect();
    for (index, token) in tokens.iter().enumerate() {
        match token {
            TokenTree::Group(group) => {
                if let Some(place) = inside(group.stream()) {
                    return Some(place);
                }
            }
            TokenTree::Ident(word) if *word == "param" => {
                let follows_colon = index > 0 && is_colon(tokens.get(index - 1));
                let is_path = matches!(
                    tokens.get(index + 1),
                    Some(TokenTree::Punct(punct)) if punct.as_char() == ':' && punct.spacing() == Spacing::Joint
                );
                if is_path && !follows_colon {
                    let rest = tokens[index + 1..].iter();
                    let path =
                        rest.take_while(|token| is_colon(Some(token)) || matches!(token, TokenTree::Ident(_)));
                    let (count, end) = path.fold((0, word.span()), |(count, _), token| (count + 1, token.span()));
                    // A function belongs to a user's module.
                    if !matches!(tokens.get(index + 1 + count), Some(TokenTree::Group(_))) {
                        return Some(Place { start: word.span(), end });
                    }
                }
            }
            TokenTree::Punct(_) | TokenTree::Ident(_) | TokenTree::Literal(_) => {}
        }
    }
    None
}
