//! A component that is made as Rust makes a value: `Encoder { port: 1 }`, `Encoder::new(1)`.

use crate::diagnostics::Place;
use crate::language::{item_words, starts_item};
use crate::names::nearest;
use crate::parse::Notes;
use crate::parse::block::opened;
use proc_macro2::{Ident, TokenTree};
use syn::Token;
use syn::ext::IdentExt;
use syn::parse::ParseStream;

/// Reports a function of a type, `Encoder::new`, and leaves the type.
pub(super) fn constructor(kind: &mut syn::Path, notes: &mut Notes<'_>) -> bool {
    let starts = |segment: &syn::PathSegment, is: fn(char) -> bool| segment.ident.to_string().starts_with(is);
    let mut last = kind.segments.iter().rev();
    let (Some(function), Some(of)) = (last.next(), last.next()) else { return false };
    if !starts(function, char::is_lowercase) || !starts(of, char::is_uppercase) {
        return false;
    }
    let (function, of) = (function.ident.clone(), of.ident.clone());
    let message = format!(
        "a component is named by its type, and made when the robot starts; leave `::{function}` out and give options by \
         name, as in `{of}(option = value)`"
    );
    notes.error(&function, message);
    kind.segments.pop();
    kind.segments.pop_punct();
    true
}

/// The packages of ROS that have the messages of robots.
const ROS_PACKAGES: [&str; 6] =
    ["geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs", "tf2_msgs", "trajectory_msgs"];

/// Reports messages of ROS, `External<sensor_msgs::Imu>`, and leaves the last name. No type of another crate can be a payload,
/// so that such a path names no payload either where a crate of that name is there.
pub(super) fn ros_messages(kind: &mut syn::Path, notes: &mut Notes<'_>) {
    for segment in &mut kind.segments {
        let syn::PathArguments::AngleBracketed(arguments) = &mut segment.arguments else { continue };
        for argument in &mut arguments.args {
            let syn::GenericArgument::Type(syn::Type::Path(message)) = argument else { continue };
            let path = &mut message.path;
            let (Some(first), Some(last)) = (path.segments.first(), path.segments.last()) else { continue };
            let package = first.ident.to_string();
            if path.segments.len() < 2 || !ROS_PACKAGES.contains(&&*package) {
                continue;
            }
            let last = last.clone();
            let error = format!(
                "`{package}` is a package of ROS; the payload is a type of Rust, `{}`, which the prelude has if it is one of \
                 `bb_core` (a module of that name is `self::{package}`)",
                last.ident
            );
            notes.error(&path, error);
            path.segments = std::iter::once(last).collect();
            path.leading_colon = None;
        }
    }
}

/// The error for options in braces, `Encoder { port: 1 }`, which are read if they come next.
pub(super) fn fields(kind: &syn::Path, input: ParseStream<'_>) -> Option<syn::Error> {
    let names = names(&input.fork())?;
    let braces: TokenTree = input.parse().ok()?;
    let name = kind.segments.last().map_or(String::new(), |segment| segment.ident.to_string());
    let options: Vec<String> = names.iter().map(|name| format!("{name} = …")).collect();
    let message = format!("options are written in parentheses, each with `=`: `{name}({})`", options.join(", "));
    Some(Place::of(&braces).syntax(message))
}

/// The names of the fields in braces: none where one is a word of the language, or near to one.
fn names(input: ParseStream<'_>) -> Option<Vec<String>> {
    let content = opened(input).ok()?;
    let mut names = Vec::new();
    while !content.is_empty() {
        let name = content.call(Ident::parse_any).ok()?.to_string();
        content.parse::<Token![:]>().ok()?;
        while !content.is_empty() && !content.peek(Token![,]) {
            if content.peek(Token![;]) {
                return None;
            }
            content.parse::<TokenTree>().ok()?;
        }
        content.parse::<Option<Token![,]>>().ok()?;
        names.push(name);
    }
    let is_item = match &names[..] {
        [] => true,
        [only] => nearest(only, item_words()).is_some(),
        several => several.iter().any(|name| starts_item(name)),
    };
    (!is_item).then_some(names)
}
