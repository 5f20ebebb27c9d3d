//! `#[derive(Payload)]`: its name, whether all its numbers are finite, and its encoding.

mod codec;

use crate::diagnostics::Diagnostics;
use crate::units::Unit;
use proc_macro2::{Ident, TokenStream};
use quote::{ToTokens, format_ident, quote, quote_spanned};
use syn::spanned::Spanned;
use syn::{Data, DeriveInput, Expr, ExprRange, Field, Fields, Generics, LitStr, RangeLimits};

/// The contents of `#[payload(…)]`.
#[derive(Default)]
struct Attributes {
    /// ROS has a message for it.
    is_ros: bool,
    /// `true` if the payload reports the position of a joint.
    tells_position: bool,
    /// `true` if the payload commands a joint.
    commands_joint: bool,
    /// `true` if the payload is the same in every frame.
    has_no_frame: bool,
    /// The name of its definition, if different from its own.
    name: Option<LitStr>,
}

pub(crate) fn payload(item: &DeriveInput, diagnostics: &mut Diagnostics) -> TokenStream {
    if unbounded(&item.generics, diagnostics) {
        return TokenStream::new();
    }
    let attributes = attributes(item, diagnostics);
    let name = &item.ident;
    let text = crate::names::text(name);
    let (generics, arguments, bounds) = item.generics.split_for_impl();
    let finite = match &item.data {
        Data::Struct(data) => arm(&quote!(Self), &data.fields, diagnostics),
        Data::Enum(data) if data.variants.is_empty() => quote!(_ => true,),
        Data::Enum(data) => data
            .variants
            .iter()
            .map(|variant| {
                let variant_name = &variant.ident;
                arm(&quote!(Self::#variant_name), &variant.fields, diagnostics)
            })
            .collect(),
        Data::Union(_) => {
            diagnostics.error(name, "a union cannot be a payload; use a struct or an enum".into());
            quote!(_ => true,)
        }
    };
    let shape_name = attributes.name.as_ref().map_or_else(|| quote!(#text), |name| quote!(#name));
    let field = codec::field(item, &shape_name);
    let ros = attributes.is_ros.then(|| {
        quote!(
            const ROS: ::core::option::Option<::bb_core::__private::RosLayout<Self>> =
                ::core::option::Option::Some(::bb_core::__private::RosLayout::of());
        )
    });
    let position = attributes.tells_position.then(|| {
        quote!(
            const TELLS_JOINT_POSITION: bool = true;
            fn tell_joints(&self, listener: &mut dyn ::core::ops::FnMut(::bb_core::__private::JointReading<'_>)) {
                ::bb_core::__private::JointPositions::tell(self, listener)
            }
        )
    });
    let command = attributes.commands_joint.then(|| {
        quote!(
            const COMMANDS_JOINT: bool = true;
            fn limit_command(
                &mut self,
                bounds: &::bb_core::__private::JointBounds,
            ) -> ::core::result::Result<::bb_core::__private::Exceeded, ::bb_core::__private::OutOfBounds>
            {
                ::bb_core::__private::JointCommand::limit(self, bounds)
            }
            fn stop_command() -> ::core::option::Option<Self> {
                <Self as ::bb_core::__private::JointCommand>::stop()
            }
            fn command_at_motor(
                &self,
                joint: &str,
                transmission: &::bb_core::__private::Transmission,
            ) -> ::core::option::Option<Self> {
                ::bb_core::__private::JointCommand::at_motor(self, joint, transmission)
            }
        )
    });
    let frame = (attributes.has_no_frame || attributes.tells_position).then(|| {
        quote!(
            const DEPENDS_ON_FRAME: bool = false;
        )
    });
    quote! {
        #[automatically_derived]
        impl #generics ::bb_core::Payload for #name #arguments #bounds {
            const NAME: &'static str = #text;
            #ros
            #position
            #command
            #frame
        }
        #[automatically_derived]
        impl #generics ::bb_core::Finite for #name #arguments #bounds {
            #[inline]
            fn is_finite(&self) -> bool {
                match self { #finite }
            }
        }
        #field
    }
}

/// Reports the first type parameter without a bound that makes it recordable.
fn unbounded(generics: &Generics, diagnostics: &mut Diagnostics) -> bool {
    let in_clause = |name: &Ident| {
        let predicates = generics.where_clause.iter().flat_map(|clause| &clause.predicates);
        predicates
            .into_iter()
            .any(|predicate| predicate.to_token_stream().into_iter().any(|token| *name == token.to_string()))
    };
    let mut unbounded = generics.type_params().filter(|kind| kind.bounds.is_empty() && !in_clause(&kind.ident));
    let Some(kind) = unbounded.next() else { return false };
    let name = &kind.ident;
    let message = format!("`{name}` is a field of a payload and must be one itself; write `{name}: Payload`");
    diagnostics.error(name, message);
    true
}

fn attributes(item: &DeriveInput, diagnostics: &mut Diagnostics) -> Attributes {
    let mut attributes = Attributes::default();
    for attribute in item.attrs.iter().filter(|attribute| attribute.path().is_ident("payload")) {
        let parsed = attribute.parse_nested_meta(|meta| {
            if meta.path.is_ident("ros") {
                attributes.is_ros = true;
            } else if meta.path.is_ident("joint_position") {
                attributes.tells_position = true;
            } else if meta.path.is_ident("joint_command") {
                attributes.commands_joint = true;
            } else if meta.path.is_ident("no_frame") {
                attributes.has_no_frame = true;
            } else if meta.path.is_ident("name") {
                attributes.name = Some(meta.value()?.parse()?);
            } else {
                return Err(meta.error(
                    "expected `ros`, `joint_position`, `joint_command`, `no_frame` or `name = \"package/Name\"`",
                ));
            }
            Ok(())
        });
        if let Err(error) = parsed {
            diagnostics.syntax(&error);
        }
    }
    attributes
}

/// `Self { a: f0, b: f1 } => f0 is finite & f1 is finite,`, without a branch.
fn arm(head: &TokenStream, fields: &Fields, diagnostics: &mut Diagnostics) -> TokenStream {
    let patterns = patterns(fields);
    let mut checks = quote!(true);
    for (index, field) in fields.iter().enumerate() {
        let bound = format_ident!("f{index}");
        let kind = &field.ty;
        let check = match attributes_of(field, diagnostics).is_any {
            true => quote!(is_any),
            false => quote!(is_finite),
        };
        // The only place that requires the type to be a field, so that a type that is not one is reported once.
        checks.extend(quote_spanned!(kind.span()=> & ::bb_core::__private::#check::<#kind>(#bound)));
    }
    quote!(#head { #patterns } => #checks,)
}

/// The contents of `#[payload(…)]` on a field.
#[derive(Default)]
struct FieldAttributes {
    /// `true` if the field may hold NaN and infinities.
    is_any: bool,
    /// The units of its numbers, each as it was written too.
    units: Vec<(Unit, String)>,
    /// The ends of the range of its number.
    range: Option<(Expr, Expr)>,
}

fn attributes_of(field: &Field, diagnostics: &mut Diagnostics) -> FieldAttributes {
    let mut attributes = FieldAttributes::default();
    for attribute in field.attrs.iter().filter(|attribute| attribute.path().is_ident("payload")) {
        let parsed = attribute.parse_nested_meta(|meta| {
            if meta.path.is_ident("non_finite") {
                attributes.is_any = true;
            } else if meta.path.is_ident("unit") {
                let text: LitStr = meta.value()?.parse()?;
                let unit = text.parse_with(Unit::parse)?;
                if unit.factor != 1.0 {
                    let message = format!("payloads are in SI; write `unit = \"{}\"`", unit.dimension.unit());
                    return Err(syn::Error::new(text.span(), message));
                }
                attributes.units.push((unit, text.value()));
            } else if meta.path.is_ident("range") {
                let range: Expr = meta.value()?.parse()?;
                let Expr::Range(ExprRange {
                    start: Some(start),
                    end: Some(end),
                    limits: RangeLimits::Closed(_),
                    ..
                }) = range
                else {
                    return Err(syn::Error::new_spanned(
                        range,
                        "expected a range with both ends: `range = 0.0..=1.0`",
                    ));
                };
                attributes.range = Some((*start, *end));
            } else {
                return Err(meta.error("expected `non_finite`, `unit = \"m/s\"` or `range = 0.0..=1.0`"));
            }
            Ok(())
        });
        if let Err(error) = parsed {
            diagnostics.syntax(&error);
        }
    }
    attributes
}

/// `a: f0, b: f1,`
fn patterns(fields: &Fields) -> TokenStream {
    let members = fields.members().enumerate().map(|(index, member)| {
        let bound = format_ident!("f{index}");
        quote!(#member: #bound,)
    });
    members.collect()
}
