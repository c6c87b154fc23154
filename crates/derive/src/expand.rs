//! The code that the derive writes: tables and walks, never logic.

use proc_macro2::TokenStream;
use quote::{format_ident, quote};
use syn::{
    Attribute, Data, DataEnum, DataStruct, DeriveInput, Error, Field, Fields, GenericParam, Ident, Result, Type,
    Variant, spanned::Spanned,
};

use crate::attribute::{self, Container};

/// The implementation for a struct or an enum.
pub(crate) fn expand(input: &DeriveInput) -> Result<TokenStream> {
    let number = number_parameter(input)?;
    let container = attribute::container(&input.attrs)?;
    match &input.data {
        Data::Struct(data) => expand_struct(input, data, &number, &container),
        Data::Enum(data) => expand_enum(input, data, &number, &container),
        Data::Union(_) => Err(Error::new_spanned(input, "Fields is for structs and enums")),
    }
}

/// The one type parameter that stands for the number.
fn number_parameter(input: &DeriveInput) -> Result<Ident> {
    let mut types = input.generics.params.iter();
    match (types.next(), types.next()) {
        (Some(GenericParam::Type(parameter)), None) => Ok(parameter.ident.clone()),
        _ => Err(Error::new(input.ident.span(), "Fields is for types over one kind of number: struct Name<T>")),
    }
}

/// The element of nested arrays, or the type itself.
fn element(ty: &Type) -> &Type {
    if let Type::Array(array) = ty { element(&array.elem) } else { ty }
}

fn is_number(ty: &Type, number: &Ident) -> bool {
    matches!(element(ty), Type::Path(path) if path.path.is_ident(number))
}

/// The help text of a field or variant, which must have one.
fn help(ident: &Ident, attributes: &[Attribute]) -> Result<String> {
    let help = attribute::help(attributes);
    if help.is_empty() {
        return Err(Error::new(ident.span(), format!("missing doc comment of `{ident}`: it is the help text")));
    }
    Ok(help)
}

/// The table row of a field.
fn row(field: &Field, number: &Ident) -> Result<TokenStream> {
    let ident = field
        .ident
        .as_ref()
        .ok_or_else(|| Error::new(field.span(), "fields require names, which are used in files"))?;
    let name = ident.to_string();
    let help = help(ident, &field.attrs)?;
    let ty = &field.ty;
    let attribute = attribute::number(&field.attrs)?;
    let shape = quote!(<#ty as ::stickslip_core::fields::Fields<#number>>::SHAPE);
    if !is_number(ty, number) {
        if let Type::Array(array) = ty
            && let Type::Array(_) = *array.elem
        {
            return Err(Error::new(
                ty.span(),
                "a list of lists holds numbers; make the inner list the field of a group",
            ));
        }
        if attribute.is_some() {
            return Err(Error::new_spanned(ty, format!("`{name}` is a group: its numbers carry their own attributes")));
        }
        return Ok(quote!(::stickslip_core::fields::Field {
            name: #name, symbol: "", unit: "", minimum: f64::NEG_INFINITY, maximum: f64::INFINITY, default: 0.0,
            help: #help, kind: ::stickslip_core::fields::Kind::Real, shape: #shape,
        }));
    }
    let unit_of = |a: &attribute::Number| a.unit.as_ref().map(syn::LitStr::value);
    let Some((attribute, unit)) = attribute.and_then(|a| unit_of(&a).map(|unit| (a, unit))) else {
        return Err(Error::new(
            ident.span(),
            format!(
                "missing unit of the number `{name}`; state it as in #[field(unit = \"N m\")]; \"1\" for a pure number"
            ),
        ));
    };
    let (minimum, maximum) = (bound(attribute.range.0), bound(attribute.range.1));
    let (symbol, default, kind) = (&attribute.symbol, attribute.default, format_ident!("{}", attribute.kind));
    Ok(quote!(::stickslip_core::fields::Field {
        name: #name, symbol: #symbol, unit: #unit, minimum: #minimum, maximum: #maximum, default: #default,
        help: #help, kind: ::stickslip_core::fields::Kind::#kind, shape: #shape,
    }))
}

fn bound(value: f64) -> TokenStream {
    if value == f64::INFINITY {
        quote!(f64::INFINITY)
    } else if value == f64::NEG_INFINITY {
        quote!(f64::NEG_INFINITY)
    } else {
        quote!(#value)
    }
}

/// The default of a field: the number everywhere, or that of the group.
fn default_of(ty: &Type, field: &Field, number: &Ident) -> Result<TokenStream> {
    if let Type::Array(array) = ty {
        let inner = default_of(&array.elem, field, number)?;
        let length = &array.len;
        return Ok(quote!([#inner; #length]));
    }
    if is_number(ty, number) {
        let value = attribute::number(&field.attrs)?.map_or(0.0, |a| a.default);
        return Ok(quote!(<#number as ::stickslip_core::scalar::Scalar>::of(#value)));
    }
    Ok(quote!(<#ty as ::core::default::Default>::default()))
}

fn expand_struct(input: &DeriveInput, data: &DataStruct, number: &Ident, container: &Container) -> Result<TokenStream> {
    let Fields::Named(named) = &data.fields else {
        return Err(Error::new(input.ident.span(), "fields require names, which are used in files"));
    };
    let name = &input.ident;
    let label = name.to_string();
    let mut rows = Vec::new();
    let mut defaults = Vec::new();
    let (fixed, varied): (Vec<&Field>, Vec<_>) = named.named.iter().partition(|f| attribute::is_fixed(&f.attrs));
    for field in &varied {
        rows.push(row(field, number)?);
        defaults.push(default_of(&field.ty, field, number)?);
    }
    let idents: Vec<_> = varied.iter().filter_map(|f| f.ident.as_ref()).collect();
    let types: Vec<_> = varied.iter().map(|f| &f.ty).collect();
    let fixed: Vec<_> = fixed.iter().filter_map(|f| f.ident.as_ref()).collect();
    let index = 0..idents.len();
    let help = attribute::doc(&input.attrs);
    let map_and_merge = struct_map_and_merge(name, number, &idents, &fixed);
    let laws = struct_laws(number, &varied, container);
    let check = check_function(name, container);
    Ok(quote! {
        #[automatically_derived]
        impl<#number: ::stickslip_core::scalar::Scalar> ::core::default::Default for #name<#number> {
            #[inline]
            fn default() -> Self {
                #name { #(#idents: #defaults,)* #(#fixed: ::core::default::Default::default(),)* }
            }
        }

        #[automatically_derived]
        impl<#number: ::stickslip_core::scalar::Scalar> ::stickslip_core::fields::Fields<#number> for #name<#number> {
            const NAME: &'static str = #label;
            const HELP: &'static str = #help;
            const SHAPE: ::stickslip_core::fields::Shape = ::stickslip_core::fields::Shape::Group(&[#(#rows,)*]);
            type With<Other: ::stickslip_core::scalar::Scalar> = #name<Other>;

            fn contents(&mut self, walk: &mut dyn ::stickslip_core::fields::Walk<#number>) {
                #(
                    let field = const { &<Self as ::stickslip_core::fields::Fields<#number>>::SHAPE.fields()[#index] };
                    <#types as ::stickslip_core::fields::Fields<#number>>::walk(&mut self.#idents, field, walk);
                )*
                #(::stickslip_core::fields::Fixed::counts(&mut self.#fixed, walk);)*
            }

            #map_and_merge

            #laws

            #check
        }
    })
}

/// The functions `map` and `merge` of a struct with these fields and these fixed counts.
fn struct_map_and_merge(name: &Ident, number: &Ident, idents: &[&Ident], fixed: &[&Ident]) -> TokenStream {
    quote! {
        fn map<Other: ::stickslip_core::scalar::Scalar>(
            &self,
            convert: &mut dyn FnMut(#number) -> Other,
        ) -> #name<Other> {
            #name {
                #(#idents: ::stickslip_core::fields::Fields::<#number>::map(&self.#idents, convert),)*
                #(#fixed: self.#fixed,)*
            }
        }

        #[inline(always)]
        fn merge(&self, other: &Self, join: &mut impl FnMut(#number, #number) -> #number) -> Self {
            #name {
                #(#idents: ::stickslip_core::fields::Fields::<#number>::merge(&self.#idents, &other.#idents, join),)*
                #(#fixed: self.#fixed,)*
            }
        }
    }
}

/// The function `laws` of a struct: those of its groups, then its own.
fn struct_laws(number: &Ident, varied: &[&Field], container: &Container) -> TokenStream {
    // A number has no laws of its own.
    let groups = varied.iter().enumerate().filter(|(_, field)| !is_number(&field.ty, number));
    let laws = groups.map(|(index, Field { ident, ty, .. })| {
        quote! {
            laws.enter(const { &<Self as ::stickslip_core::fields::Fields<#number>>::SHAPE.fields()[#index] });
            <#ty as ::stickslip_core::fields::Fields<#number>>::laws(&self.#ident, laws);
            laws.leave();
        }
    });
    let law = container.law.as_ref().map(|path| quote!(for law in #path(self) { laws.state(law); }));
    quote! {
        fn laws(&self, laws: &mut dyn ::stickslip_core::fields::Laws<#number>) {
            #(#laws)*
            #law
        }
    }
}

/// The function `check`, where the struct names one.
fn check_function(name: &Ident, container: &Container) -> Option<TokenStream> {
    let path = container.check.as_ref()?;
    Some(quote! {
        fn check(values: &#name<f64>) -> ::core::result::Result<(), ::stickslip_core::fields::ParameterError> {
            #path(values)
        }
    })
}

/// A variant of an enum: its name, and its struct of numbers where it holds one.
struct Choice<'a> {
    ident: &'a Ident,
    inner: Option<&'a Type>,
}

fn expand_enum(input: &DeriveInput, data: &DataEnum, number: &Ident, container: &Container) -> Result<TokenStream> {
    let name = &input.ident;
    let label = name.to_string();
    let tag = container.tag.clone().unwrap_or_else(|| "model".into());
    let doc = attribute::doc(&input.attrs);
    if let Some(check) = container.law.as_ref().or(container.check.as_ref()) {
        return Err(Error::new_spanned(check, "a law belongs to a struct: state it at the variant's struct"));
    }
    let mut table = Vec::new();
    let mut choices = Vec::new();
    for variant in &data.variants {
        let help = help(&variant.ident, &variant.attrs)?;
        let choice = Choice { ident: &variant.ident, inner: held(variant, number)? };
        table.push(variant_row(&choice, &help, number));
        choices.push(choice);
    }
    let defaults: Vec<_> = choices.iter().map(|choice| variant_default(name, choice)).collect();
    let first = defaults.first().ok_or_else(|| Error::new(name.span(), "an enum requires variants"))?;
    let contents = enum_contents(name, number, &tag, &choices, &defaults);
    let map_and_merge = enum_map_and_merge(name, number, &choices);
    let laws = enum_laws(name, number, &choices);
    Ok(quote! {
        #[automatically_derived]
        impl<#number: ::stickslip_core::scalar::Scalar> ::core::default::Default for #name<#number> {
            fn default() -> Self {
                #first
            }
        }

        #[automatically_derived]
        impl<#number: ::stickslip_core::scalar::Scalar> ::stickslip_core::fields::Fields<#number> for #name<#number> {
            const NAME: &'static str = #label;
            const HELP: &'static str = #doc;
            const SHAPE: ::stickslip_core::fields::Shape =
                ::stickslip_core::fields::Shape::Choice { tag: #tag, variants: &[#(#table,)*] };
            type With<Other: ::stickslip_core::scalar::Scalar> = #name<Other>;

            #contents

            #map_and_merge

            #laws
        }
    })
}

/// The struct of numbers that a variant holds; `None` where it holds nothing.
fn held<'a>(variant: &'a Variant, number: &Ident) -> Result<Option<&'a Type>> {
    let inner = match &variant.fields {
        Fields::Unit => return Ok(None),
        Fields::Unnamed(fields) if fields.unnamed.len() == 1 => &fields.unnamed[0].ty,
        _ => return Err(Error::new(variant.ident.span(), "a variant holds nothing or one struct of numbers")),
    };
    if is_number(inner, number) || matches!(inner, Type::Array(_)) {
        return Err(Error::new(
            inner.span(),
            "a variant holds nothing or one struct of numbers: a number requires a name",
        ));
    }
    Ok(Some(inner))
}

/// The table row of a variant.
fn variant_row(Choice { ident, inner }: &Choice<'_>, help: &str, number: &Ident) -> TokenStream {
    let file_name = kebab(&ident.to_string());
    let shape = match inner {
        Some(ty) => quote!(<#ty as ::stickslip_core::fields::Fields<#number>>::SHAPE),
        None => quote!(::stickslip_core::fields::Shape::Group(&[])),
    };
    quote!(::stickslip_core::fields::Variant { name: #file_name, help: #help, shape: #shape })
}

fn variant_default(name: &Ident, Choice { ident, inner }: &Choice<'_>) -> TokenStream {
    match inner {
        Some(_) => quote!(#name::#ident(::core::default::Default::default())),
        None => quote!(#name::#ident),
    }
}

/// The function `contents` of an enum: the variant and its contents.
fn enum_contents(
    name: &Ident,
    number: &Ident,
    tag: &str,
    choices: &[Choice<'_>],
    defaults: &[TokenStream],
) -> TokenStream {
    let numbers = 0..choices.len();
    let current = choices.iter().enumerate().map(|(index, Choice { ident, inner })| match inner {
        Some(_) => quote!(#name::#ident(_) => #index),
        None => quote!(#name::#ident => #index),
    });
    let contents = choices.iter().map(|Choice { ident, inner }| match inner {
        Some(ty) => {
            quote!(#name::#ident(inner) => <#ty as ::stickslip_core::fields::Fields<#number>>::contents(inner, walk))
        }
        None => quote!(#name::#ident => {}),
    });
    quote! {
        fn contents(&mut self, walk: &mut dyn ::stickslip_core::fields::Walk<#number>) {
            let variants = const { <Self as ::stickslip_core::fields::Fields<#number>>::SHAPE.variants() };
            let current: usize = match self { #(#current,)* };
            let wanted = walk.choice(#tag, variants, current);
            if wanted != current {
                *self = match wanted { #(#numbers => #defaults,)* _ => *self };
            }
            match self { #(#contents,)* }
        }
    }
}

/// The functions `map` and `merge` of an enum.
fn enum_map_and_merge(name: &Ident, number: &Ident, choices: &[Choice<'_>]) -> TokenStream {
    let map = choices.iter().map(|Choice { ident, inner }| match inner {
        Some(_) => quote!(#name::#ident(inner) => #name::#ident(::stickslip_core::fields::Fields::<#number>::map(inner, convert))),
        None => quote!(#name::#ident => #name::#ident),
    });
    let merge = choices.iter().filter(|choice| choice.inner.is_some()).map(|Choice { ident, .. }| {
        quote!((#name::#ident(a), #name::#ident(b)) => #name::#ident(::stickslip_core::fields::Fields::<#number>::merge(a, b, join)))
    });
    quote! {
        fn map<Other: ::stickslip_core::scalar::Scalar>(
            &self,
            convert: &mut dyn FnMut(#number) -> Other,
        ) -> #name<Other> {
            match self { #(#map,)* }
        }

        #[inline(always)]
        fn merge(&self, other: &Self, join: &mut impl FnMut(#number, #number) -> #number) -> Self {
            match (self, other) {
                #(#merge,)*
                #[allow(unreachable_patterns, reason = "an enum of one variant has no others")]
                _ => *self,
            }
        }
    }
}

/// The function `laws` of an enum: those of its variant.
fn enum_laws(name: &Ident, number: &Ident, choices: &[Choice<'_>]) -> TokenStream {
    let laws = choices.iter().map(|Choice { ident, inner }| match inner {
        Some(ty) => {
            quote!(#name::#ident(inner) => <#ty as ::stickslip_core::fields::Fields<#number>>::laws(inner, laws))
        }
        None => quote!(#name::#ident => {}),
    });
    quote! {
        fn laws(&self, laws: &mut dyn ::stickslip_core::fields::Laws<#number>) {
            match self { #(#laws,)* }
        }
    }
}

/// `ElastoPlastic` → `elasto-plastic`, `PointToPoint` → `point-to-point`. An acronym stays together: `LuGre` → `lugre`,
/// `PI` → `pi`.
fn kebab(ident: &str) -> String {
    let mut out = String::new();
    let (mut words, mut run) = (0, 0);
    for c in ident.chars() {
        // A capital starts a new word after three letters; after two within a name, such as `To`, but not at its start.
        if c.is_uppercase() && (run > 2 || (run > 1 && words > 0)) {
            out.push('-');
            (words, run) = (words + 1, 0);
        }
        run += 1;
        out.extend(c.to_lowercase());
    }
    out
}

#[cfg(test)]
mod tests {
    #[test]
    fn variants_are_named_by_their_words_and_acronyms_stay_together() {
        let names = ["ElastoPlastic", "PointToPoint", "LuGre", "PI", "PPi", "RandomStrokes", "Prbs"].map(super::kebab);
        let expected = ["elasto-plastic", "point-to-point", "lugre", "pi", "ppi", "random-strokes", "prbs"];
        assert_eq!(names, expected);
    }
}
