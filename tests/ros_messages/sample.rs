//! Fills a message with values that are all different, and writes down what it asked for.
//!
//! The one source of values is a counter, so two swapped fields of one type give other bytes. What a
//! struct asks for is its name, the names of its fields and their types, in wire order.

use serde::de::value::Error;
use serde::de::{DeserializeOwned, DeserializeSeed, Deserializer, Error as _, SeqAccess, Visitor};

/// How many members each sequence gets.
const MEMBERS: usize = 2;

/// What a struct asks for: its name, and type and name of each field.
#[derive(Debug, PartialEq)]
pub struct Shape {
    pub name: &'static str,
    pub fields: Vec<(String, String)>,
}

/// A message full of different values, and its shape.
pub fn sample<T: DeserializeOwned>() -> (T, Shape) {
    let (mut counter, mut shape, mut kind) = (0, None, String::new());
    let value = T::deserialize(Filler { counter: &mut counter, shape: Some(&mut shape), kind: &mut kind });
    (value.expect("every type is known"), shape.expect("a struct"))
}

struct Filler<'a> {
    counter: &'a mut u32,
    /// Where to write the shape; `None` below the outermost struct.
    shape: Option<&'a mut Option<Shape>>,
    /// Becomes the type of what is filled.
    kind: &'a mut String,
}

impl Filler<'_> {
    fn next(&mut self, kind: &str) -> u32 {
        *self.kind = kind.into();
        *self.counter += 1;
        *self.counter
    }
}

/// The members of a struct, array or sequence, one after the other.
struct Members<'a> {
    counter: &'a mut u32,
    kinds: Vec<String>,
    left: usize,
}

impl<'de> SeqAccess<'de> for &mut Members<'_> {
    type Error = Error;

    fn next_element_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, Error> {
        if self.left == 0 {
            return Ok(None);
        }
        self.left -= 1;
        let mut kind = String::new();
        let filler = Filler { counter: self.counter, shape: None, kind: &mut kind };
        let value = seed.deserialize(filler)?;
        self.kinds.push(kind);
        Ok(Some(value))
    }
}

macro_rules! numbers {
    ($($method:ident $visit:ident $type:ty, $kind:literal);+ $(;)?) => {$(
        fn $method<V: Visitor<'de>>(mut self, visitor: V) -> Result<V::Value, Error> {
            let value = self.next($kind);
            // Small types wrap: neighbours still differ.
            visitor.$visit(value as $type)
        }
    )+};
}

impl<'de> Deserializer<'de> for Filler<'_> {
    type Error = Error;

    numbers! {
        deserialize_i8 visit_i8 i8, "int8";
        deserialize_i16 visit_i16 i16, "int16";
        deserialize_i32 visit_i32 i32, "int32";
        deserialize_i64 visit_i64 i64, "int64";
        deserialize_u8 visit_u8 u8, "uint8";
        deserialize_u16 visit_u16 u16, "uint16";
        deserialize_u32 visit_u32 u32, "uint32";
        deserialize_u64 visit_u64 u64, "uint64";
        deserialize_f32 visit_f32 f32, "float32";
        deserialize_f64 visit_f64 f64, "float64";
    }

    fn deserialize_bool<V: Visitor<'de>>(mut self, visitor: V) -> Result<V::Value, Error> {
        let value = self.next("bool");
        visitor.visit_bool(value.is_multiple_of(2))
    }

    fn deserialize_string<V: Visitor<'de>>(mut self, visitor: V) -> Result<V::Value, Error> {
        let value = self.next("string");
        // Lengths differ, so that what follows is aligned in all ways.
        visitor.visit_string("x".repeat(value as usize % 7) + &value.to_string())
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        let mut members = Members { counter: self.counter, kinds: Vec::new(), left: MEMBERS };
        let value = visitor.visit_seq(&mut members)?;
        *self.kind = format!("{}[]", members.kinds[0]);
        Ok(value)
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, count: usize, visitor: V) -> Result<V::Value, Error> {
        let mut members = Members { counter: self.counter, kinds: Vec::new(), left: count };
        let value = visitor.visit_seq(&mut members)?;
        *self.kind = format!("{}[{count}]", members.kinds[0]);
        Ok(value)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        let mut members = Members { counter: self.counter, kinds: Vec::new(), left: fields.len() };
        let value = visitor.visit_seq(&mut members)?;
        *self.kind = name.into();
        if let Some(shape) = self.shape {
            let names = fields.iter().map(|field| field.to_string());
            *shape = Some(Shape { name, fields: members.kinds.into_iter().zip(names).collect() });
        }
        Ok(value)
    }

    fn deserialize_any<V: Visitor<'de>>(self, _visitor: V) -> Result<V::Value, Error> {
        Err(Error::custom("no message has a field of this type"))
    }

    serde::forward_to_deserialize_any! {
        char str bytes byte_buf option unit unit_struct newtype_struct tuple_struct map enum identifier
        ignored_any
    }
}
