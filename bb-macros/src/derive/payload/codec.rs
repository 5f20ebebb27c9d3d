//! The implementation of `Field`: the shape, the use of the heap, writing, reading.
//!
//! ```text
//! const SHAPE: Shape = Shape::Struct(&StructShape { name: "Imu", fields: &[FieldShape::new("rate", …::SHAPE)] });
//! const IS_INLINE: bool = true && FieldOf::<f64>::IS_INLINE;
//! fn heap_bytes(&self) -> usize { match self { Self { rate: f0 } => 0 + FieldOf::<f64>::heap_bytes(f0) } }
//! fn write(…) { match self { Self { rate: f0 } => { FieldOf::write(f0, writer); } } }
//! fn read(…) { Ok(Self { rate: match FieldOf::<f64>::read(reader, "rate") { Ok(value) => value, Err(error) => return Err(error) } }) }
//! ```
//!
//! `read` is the largest function of a payload. What names the field in an error is compiled once for each type, and not for each field.

use super::{attributes_of, patterns};
use crate::diagnostics::Diagnostics;
use proc_macro2::TokenStream;
use quote::{format_ident, quote};
use syn::{Data, DataEnum, DeriveInput, Field, Fields, Member};

pub(super) fn field(item: &DeriveInput, text: &TokenStream) -> TokenStream {
    let name = &item.ident;
    let (generics, arguments, bounds) = item.generics.split_for_impl();
    let all_fields: Vec<&Field> = match &item.data {
        Data::Struct(data) => data.fields.iter().collect(),
        Data::Enum(data) => data.variants.iter().flat_map(|variant| &variant.fields).collect(),
        Data::Union(_) => Vec::new(),
    };
    let kinds = all_fields.iter().map(|field| &field.ty);
    let Parts { shape, heap_bytes, write, read } = match &item.data {
        Data::Struct(data) => of_struct(&data.fields, text),
        Data::Enum(data) => of_enum(data, text),
        Data::Union(_) => of_struct(&Fields::Unit, text),
    };
    quote! {
        const _: () = {
            #[allow(unused_imports)]
            use ::bb_core::__private::{
                EnumShape, FieldOf, FieldShape, FieldUnit, NotField as _, Reader, Shape, StructShape, Writer,
            };

            #[automatically_derived]
            impl #generics ::bb_core::Field for #name #arguments #bounds {
                const SHAPE: Shape = #shape;
                const IS_INLINE: bool = true #(&& FieldOf::<#kinds>::IS_INLINE)*;
                fn heap_bytes(&self) -> usize {
                    match self { #heap_bytes }
                }
                fn write(&self, writer: &mut Writer<'_>) {
                    match self { #write }
                }
                fn read(reader: &mut Reader<'_>) -> ::core::result::Result<Self, ::bb_core::__private::DecodeError> {
                    #read
                }
            }
        };
    }
}

struct Parts {
    shape: TokenStream,
    heap_bytes: TokenStream,
    write: TokenStream,
    read: TokenStream,
}

fn of_struct(fields: &Fields, text: &TokenStream) -> Parts {
    let shape = struct_shape(fields, text);
    let (patterns, writes, reads) = (patterns(fields), writes(fields), reads(fields, ""));
    let heap_bytes = heap_bytes(fields);
    let nothing = fields.is_empty().then(|| quote!(writer.nothing();));
    Parts {
        shape: quote!(Shape::Struct(&#shape)),
        heap_bytes: quote!(Self { #patterns } => #heap_bytes,),
        write: quote!(Self { #patterns } => { #writes #nothing }),
        read: match fields.is_empty() {
            true => quote!(reader.nothing().map(|()| Self { #reads })),
            false => quote!(::core::result::Result::Ok(Self { #reads })),
        },
    }
}

/// The number of the variant, then for each variant with fields a list of at most one.
fn of_enum(data: &DataEnum, text: &TokenStream) -> Parts {
    let lists = data.variants.iter().filter(|variant| !variant.fields.is_empty()).count();
    let mut before = 0;
    let (mut shapes, mut write, mut read) = (TokenStream::new(), TokenStream::new(), TokenStream::new());
    let mut sums = TokenStream::new();
    for (number, variant) in (0u32..).zip(&data.variants) {
        let (name, fields) = (&variant.ident, &variant.fields);
        let variant_text = crate::names::text(name);
        let shape = match fields.is_empty() {
            true => quote!(StructShape { name: #variant_text, fields: &[] }),
            false => struct_shape(fields, &quote!(#variant_text)),
        };
        shapes.extend(quote!(#shape,));
        let (patterns, writes) = (patterns(fields), writes(fields));
        let reads = reads(fields, &format!("{variant_text}."));
        let sum = heap_bytes(fields);
        sums.extend(quote!(Self::#name { #patterns } => #sum,));
        if fields.is_empty() {
            write.extend(quote!(Self::#name { #patterns } => writer.variant(#number, #lists),));
            read.extend(quote!(#number => Self::#name { #reads },));
        } else {
            let after = lists - before - 1;
            write.extend(quote!(Self::#name { #patterns } => {
                writer.variant(#number, #before);
                writer.present();
                #writes
                writer.absent(#after);
            }));
            read.extend(quote!(#number => Self::#name { #reads },));
            before += 1;
        }
    }
    if data.variants.is_empty() {
        write = quote!(_ => { let _ = writer; });
        sums = quote!(_ => 0,);
    }
    let read = quote! {
        let number = reader.variant(&Self::SHAPE)?;
        let value = match number {
            #read
            other => return ::core::result::Result::Err(reader.no_variant(other)),
        };
        reader.end_variant(&Self::SHAPE, number).map(|()| value)
    };
    Parts {
        shape: quote!(Shape::Enum(&EnumShape { name: #text, variants: &[#shapes] })),
        heap_bytes: sums,
        write,
        read,
    }
}

fn struct_shape(fields: &Fields, text: &TokenStream) -> TokenStream {
    let shapes = fields.iter().zip(fields.members()).map(|(field, member)| {
        let (name, kind) = (text_of(&member), &field.ty);
        // Errors in the attributes have been reported.
        let attributes = attributes_of(field, &mut Diagnostics::default());
        let units: Vec<TokenStream> = attributes
            .units
            .into_iter()
            .map(|(unit, symbol)| {
                let (crate::units::Dimension(exponents), dimension) = (unit.dimension, unit.dimension.name());
                quote!(FieldUnit { exponents: [#(#exponents),*], dimension: #dimension, symbol: #symbol })
            })
            .collect();
        let in_units = (!units.is_empty()).then(|| quote!(.in_units(&[#(#units),*])));
        let doc = crate::derive::fields::doc(&field.attrs);
        let documented = (!doc.is_empty()).then(|| quote!(.documented(#doc)));
        let in_range = attributes.range.map(|(start, end)| quote!(.in_range(#start as f64, #end as f64)));
        quote!(FieldShape::new(#name, FieldOf::<#kind>::SHAPE) #in_units #in_range #documented,)
    });
    let shapes: TokenStream = if fields.is_empty() { quote!(FieldShape::NOTHING) } else { shapes.collect() };
    quote!(StructShape { name: #text, fields: &[#shapes] })
}

fn writes(fields: &Fields) -> TokenStream {
    let writes = fields.iter().enumerate().map(|(index, field)| {
        let (bound, kind) = (format_ident!("f{index}"), &field.ty);
        quote!(FieldOf::<#kind>::write(#bound, writer);)
    });
    writes.collect()
}

/// `0 + FieldOf::<f64>::heap_bytes(f0)`
fn heap_bytes(fields: &Fields) -> TokenStream {
    let bounds = (0..fields.len()).map(|index| format_ident!("f{index}"));
    let kinds = fields.iter().map(|field| &field.ty);
    quote!(0 #(+ FieldOf::<#kinds>::heap_bytes(#bounds))*)
}

fn reads(fields: &Fields, within: &str) -> TokenStream {
    let reads = fields.iter().zip(fields.members()).map(|(field, member)| {
        let (path, kind) = (format!("{within}{}", text_of(&member)), &field.ty);
        quote!(#member: match FieldOf::<#kind>::read(reader, #path) {
            ::core::result::Result::Ok(value) => value,
            ::core::result::Result::Err(error) => return ::core::result::Result::Err(error),
        },)
    });
    reads.collect()
}

fn text_of(member: &Member) -> String {
    match member {
        Member::Named(name) => crate::names::text(name),
        Member::Unnamed(index) => index.index.to_string(),
    }
}
