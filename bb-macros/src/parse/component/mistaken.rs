//! Components written in other syntaxes: `Encoder { port: 1 }`, `Encoder::new(1)`, `sensor_msgs::Image()`.

use crate::diagnostics::Place;
use crate::language::{item_words, starts_item};
use crate::names::nearest;
use crate::parse::Notes;
use crate::parse::block::opened;
use proc_macro2::{Ident, TokenTree};
use syn::ext::IdentExt;
use syn::parse::ParseStream;
use syn::{LitStr, Token};

/// Reports an associated function, `Encoder::new`, and removes it from the path.
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

/// The ROS packages with the messages of robots.
const ROS_PACKAGES: [&str; 12] = [
    "action_msgs",
    "builtin_interfaces",
    "control_msgs",
    "diagnostic_msgs",
    "geometry_msgs",
    "nav_msgs",
    "sensor_msgs",
    "std_msgs",
    "std_srvs",
    "tf2_msgs",
    "trajectory_msgs",
    "visualization_msgs",
];

/// The package and the last name of a ROS type: `sensor_msgs::msg::Image`.
fn of_ros(path: &syn::Path) -> Option<(String, syn::PathSegment)> {
    let package = path.segments.first()?.ident.to_string();
    let is_of_ros = path.segments.len() > 1 && ROS_PACKAGES.contains(&&*package);
    is_of_ros.then(|| path.segments.last().map(|last| (package, last.clone()))).flatten()
}

/// Reports ROS types. `sensor_msgs::Image()` becomes an unknown component, `External<sensor_msgs::Imu>` keeps the
/// last name. A type of another crate cannot be a payload, so such a path never names a payload, even if a crate of
/// that name exists.
pub(super) fn ros_types(word: &str, kind: &mut syn::Path, notes: &mut Notes<'_>) {
    if let Some((package, message)) = of_ros(kind) {
        let message = message.ident;
        let expected = if word == "sensor" {
            format!(
                "a sensor is declared by its driver's type in Rust, or as `External<{message}>()` if other code publishes it"
            )
        } else {
            format!("expected the type of Rust that implements this `{word}`")
        };
        let error =
            format!("`{package}` is a package of ROS; {expected} (a module of that name is `self::{package}`)");
        notes.error(&*kind, error);
        *kind = syn::parse_quote!(::bb_core::__private::Unknown);
        return;
    }
    for segment in &mut kind.segments {
        let syn::PathArguments::AngleBracketed(arguments) = &mut segment.arguments else { continue };
        for argument in &mut arguments.args {
            let syn::GenericArgument::Type(syn::Type::Path(message)) = argument else { continue };
            let path = &mut message.path;
            let Some((package, last)) = of_ros(path) else { continue };
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

/// The error for other tokens in place of a type: `"Bmi270"`, `dyn Sensor`, `&Bmi270`.
pub(super) fn type_of(name: &Ident, input: ParseStream<'_>) -> Option<syn::Error> {
    let place = input.span();
    let message = if let Ok(text) = input.fork().parse::<LitStr>()
        && syn::parse_str::<syn::Path>(&text.value()).is_ok()
    {
        format!("a type is written without quotes: `{name}: {}()`", text.value())
    } else if input.peek(Token![dyn]) || input.peek(Token![impl]) || input.peek(Token![&]) {
        format!("expected the type of `{name}` itself, as in `{name}: Type()`")
    } else {
        return None;
    };
    Some(syn::Error::new(place, message))
}

/// The error for syntax that follows a component in other languages: `Bmi270().rate(200)`, `Bmi270() @ 200 Hz`,
/// `Bmi270 | Bmi088`.
pub(super) fn tail(name: &Ident, input: ParseStream<'_>) -> Option<syn::Error> {
    let is_tail = input.peek(Token![.]) || input.peek(Token![@]) || input.peek(Token![|]) || input.peek(Token![=]);
    let message = format!(
        "expected `;` or braces after `{name}`; options go into parentheses, settings into braces: `Type(option = value) {{ … }}`"
    );
    is_tail.then(|| input.error(message))
}

/// The error for options in braces, `Encoder { port: 1 }`, which are read if they follow.
pub(super) fn fields(kind: &syn::Path, input: ParseStream<'_>) -> Option<syn::Error> {
    let names = names(&input.fork())?;
    let braces: TokenTree = input.parse().ok()?;
    let name = kind.segments.last().map_or(String::new(), |segment| segment.ident.to_string());
    let options: Vec<String> = names.iter().map(|name| format!("{name} = …")).collect();
    let message = format!("options are written in parentheses, each with `=`: `{name}({})`", options.join(", "));
    Some(Place::of(&braces).syntax(message))
}

/// The names of the fields in braces; `None` if one is a word of the language, or near to one.
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
