//! Values of any shape.

use super::super::super::{Field, Shape, Writer, decode};

/// SplitMix64: values of any shape from one seed.
pub(super) struct Random(pub(super) u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        usize::try_from(self.next() % end as u64).expect("it is below a usize")
    }

    /// Any bits, and often the numbers with a special meaning in ROS.
    fn float(&mut self) -> f64 {
        match self.below(6) {
            0 => f64::from_bits(self.next()),
            1 => [0.0, -0.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY][self.below(6)],
            _ => self.next() as i64 as f64 * 1e-18,
        }
    }

    fn write(&mut self, name: &str, shape: Shape, writer: &mut Writer<'_>) {
        match shape {
            Shape::Bool => (self.below(2) == 1).write(writer),
            Shape::Char => 'x'.write(writer),
            Shape::U8 | Shape::Byte | Shape::I8 => (self.next() as u8).write(writer),
            Shape::U16 | Shape::I16 => (self.next() as u16).write(writer),
            // Nanoseconds are below a second.
            Shape::U32 if name == "nanosec" => ((self.next() % 1_000_000_000) as u32).write(writer),
            Shape::U32 | Shape::I32 => (self.next() as u32).write(writer),
            // Sometimes small enough for ROS.
            Shape::U64 | Shape::I64 => {
                let shift = self.below(48);
                (self.next() >> shift).write(writer);
            }
            Shape::F32 => (self.float() as f32).write(writer),
            Shape::F64 => self.float().write(writer),
            Shape::Text => writer.text(["", "base_link", "é", "left wheel"][self.below(4)]),
            Shape::Option(of) => {
                let length = self.below(2);
                writer.length(length);
                self.some(length, *of, writer);
            }
            Shape::List(of) => {
                let length = self.below(4);
                writer.length(length);
                self.some(length, *of, writer);
            }
            // An unknown covariance of ROS.
            Shape::Array(Shape::F64, length) if self.below(4) == 0 => {
                vec![0.0; length].iter().for_each(|zero: &f64| zero.write(writer))
            }
            Shape::Array(of, length) => self.some(length, *of, writer),
            Shape::Struct(of) => of.fields.iter().for_each(|field| self.write(field.name, field.shape, writer)),
            Shape::Enum(of) => {
                let number = self.below(of.variants.len());
                writer.variant(u32::try_from(number).expect("there are few"), 0);
                for (index, variant) in
                    of.variants.iter().enumerate().filter(|(_, variant)| !variant.fields.is_empty())
                {
                    writer.length(usize::from(index == number));
                    if index == number {
                        variant.fields.iter().for_each(|field| self.write(field.name, field.shape, writer));
                    }
                }
            }
        }
    }

    fn some(&mut self, length: usize, of: Shape, writer: &mut Writer<'_>) {
        for _ in 0..length {
            self.write("", of, writer);
        }
    }

    pub(super) fn value<T: Field>(&mut self) -> T {
        let mut bytes = vec![0, 1, 0, 0];
        let mut body = Vec::new();
        self.write("", T::SHAPE, &mut Writer::new(&mut body));
        bytes.extend(body);
        decode(&bytes).expect("it has the shape")
    }
}
