//! nalgebra's types. Matrices are written row by row, as in ROS; quaternions as x, y, z, w.

use super::collections::heap_bytes_of;
use super::{DecodeError, Field, FieldShape, Reader, Shape, StructShape, Writer};
use crate::message::Finite;
use nalgebra::{
    DMatrix, DVector, Isometry3, Matrix, Quaternion, RawStorage, SMatrix, Scalar, Translation3, Unit,
    UnitQuaternion, Vector3, Vector4,
};

/// The parts of a vector or a quaternion by name.
struct Named<T>(T);

impl<T: Field> Named<T> {
    const XYZW: [FieldShape; 4] = [
        FieldShape::new("x", T::SHAPE),
        FieldShape::new("y", T::SHAPE),
        FieldShape::new("z", T::SHAPE),
        FieldShape::new("w", T::SHAPE),
    ];
    const XYZ: [FieldShape; 3] = [Self::XYZW[0], Self::XYZW[1], Self::XYZW[2]];
    const IS_ROS: bool = matches!(T::SHAPE, Shape::F64);
    const VECTOR: StructShape =
        StructShape { name: if Self::IS_ROS { "geometry_msgs/Vector3" } else { "Vector3" }, fields: &Self::XYZ };
    const QUATERNION: StructShape = StructShape {
        name: if Self::IS_ROS { "geometry_msgs/Quaternion" } else { "Quaternion" },
        fields: &Self::XYZW,
    };
}

/// A column of three is `geometry_msgs/Vector3`; any other matrix is its elements row by row.
impl<T: Field + Scalar, const R: usize, const C: usize> Field for SMatrix<T, R, C> {
    const SHAPE: Shape = match R * C {
        0 => Shape::Option(&T::SHAPE),
        3 if C == 1 => Shape::Struct(&Named::<T>::VECTOR),
        elements => Shape::Array(&T::SHAPE, elements),
    };
    const IS_INLINE: bool = T::IS_INLINE;
    fn heap_bytes(&self) -> usize {
        heap_bytes_of(self)
    }
    fn write(&self, writer: &mut Writer<'_>) {
        if R * C == 0 {
            writer.length(0);
        }
        write_rows(self, writer);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        if R * C == 0 {
            reader.absent(1)?;
        }
        let elements = T::read_all(R * C, reader)?;
        Ok(Self::from_row_iterator(elements))
    }
}

fn write_rows<T, R, C, S>(matrix: &Matrix<T, R, C, S>, writer: &mut Writer<'_>)
where
    T: Field,
    R: nalgebra::Dim,
    C: nalgebra::Dim,
    S: RawStorage<T, R, C>,
{
    if matrix.is_empty() {
        // Billions of rows without columns take no bytes, so any input may claim them.
        return;
    }
    for row in 0..matrix.nrows() {
        for column in 0..matrix.ncols() {
            if let Some(element) = matrix.get((row, column)) {
                element.write(writer);
            }
        }
    }
}

impl<T: Field + Scalar> Field for DVector<T> {
    const SHAPE: Shape = Shape::List(&T::SHAPE);
    fn heap_bytes(&self) -> usize {
        size_of_val(self.as_slice()) + heap_bytes_of(self)
    }
    fn write(&self, writer: &mut Writer<'_>) {
        writer.length(self.nrows());
        write_rows(self, writer);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        Vec::read(reader).map(Self::from_vec)
    }
}

impl<T: Field + Scalar> Field for DMatrix<T> {
    const SHAPE: Shape = Shape::Struct(&StructShape {
        name: "Matrix",
        fields: &[
            FieldShape::new("rows", Shape::U32),
            FieldShape::new("columns", Shape::U32),
            FieldShape::new("data", Shape::List(&T::SHAPE)),
        ],
    });
    fn heap_bytes(&self) -> usize {
        size_of_val(self.as_slice()) + heap_bytes_of(self)
    }
    fn write(&self, writer: &mut Writer<'_>) {
        writer.length(self.nrows());
        writer.length(self.ncols());
        writer.length(self.len());
        write_rows(self, writer);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let (rows, columns): (u32, u32) = (reader.field("rows")?, reader.field("columns")?);
        let data: Vec<T> = reader.field("data")?;
        if u64::from(rows) * u64::from(columns) != data.len() as u64 {
            let found = format!("{} for {rows} rows and {columns} columns", data.len());
            return Err(reader.error("as many elements as rows and columns make", found).within("data"));
        }
        match data.is_empty() {
            // As for writing: nalgebra would iterate over the rows.
            true => Ok(Self::from_vec(rows as usize, columns as usize, data)),
            false => Ok(Self::from_row_iterator(rows as usize, columns as usize, data)),
        }
    }
}

impl<T: Field + Scalar> Field for Quaternion<T> {
    const SHAPE: Shape = Shape::Struct(&Named::<T>::QUATERNION);
    const IS_INLINE: bool = T::IS_INLINE;
    fn heap_bytes(&self) -> usize {
        self.coords.heap_bytes()
    }
    fn write(&self, writer: &mut Writer<'_>) {
        self.coords.write(writer);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        Vector4::read(reader).map(|coords| Self { coords })
    }
}

/// Read as it was written, whether of unit length or not.
impl<T: Field> Field for Unit<T>
where
    Unit<T>: Finite,
{
    const SHAPE: Shape = T::SHAPE;
    const IS_INLINE: bool = T::IS_INLINE;
    fn heap_bytes(&self) -> usize {
        self.as_ref().heap_bytes()
    }
    fn write(&self, writer: &mut Writer<'_>) {
        self.as_ref().write(writer);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        T::read(reader).map(Self::new_unchecked)
    }
}

impl Field for Isometry3<f64> {
    const SHAPE: Shape = Shape::Struct(&StructShape {
        name: "geometry_msgs/Transform",
        fields: &[
            FieldShape::new("translation", Vector3::<f64>::SHAPE),
            FieldShape::new("rotation", UnitQuaternion::<f64>::SHAPE),
        ],
    });
    const IS_INLINE: bool = true;
    fn write(&self, writer: &mut Writer<'_>) {
        self.translation.vector.write(writer);
        self.rotation.write(writer);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let translation: Vector3<f64> = reader.field("translation")?;
        Ok(Self::from_parts(Translation3::from(translation), reader.field("rotation")?))
    }
}
