#pragma once

#include <mrpt/math/TPoint3D.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mp2p_icp
{
/** What every cloud reader makes of its bytes: coordinates in double, as they stand in the file (also the
 * points that are not finite), and the two extra channels that MRPT has a place for.
 */
struct RawCloud
{
    std::string kind;  ///< such as `PLY (ascii)`
    std::vector<mrpt::math::TPoint3D> points;
    std::vector<float> intensity;                        ///< empty, or one per point
    std::vector<std::array<float, 3>> rgb;               ///< empty, or one per point, in [0,1]
    std::optional<mrpt::math::TPoint3D> written_offset;  ///< the offset that save_map() noted in the header
    std::vector<std::string> notes;
};

/// A column of a file of points: its name there, and whether its values are whole numbers (colours: 0 to
/// 255).
struct CloudColumn
{
    std::string name;
    bool is_integer = false;
    bool is_skipped = false;  ///< lists and the like: named in the notes, never delivered
};

/** Sorts the columns of a table of points into a RawCloud, by their names: x y z, intensity (or
 * scalar_intensity, reflectance), red green blue (or r g b), and rgb or rgba (packed 0xRRGGBB). Names are
 * compared without regard to case. Columns that MRPT has no place for are named in a note.
 */
class RawCloudBuilder
{
 public:
    /// \exception DataError if x, y or z is missing or stands twice.
    RawCloudBuilder(const std::string& source, const std::string& place,
                    const std::vector<CloudColumn>& columns);

    /** Makes room for exactly this many rows. The caller has checked that the file can hold them.
     * \param bytes_held the file's bytes that are in memory meanwhile
     * \exception DataError if that needs more memory than the budget.
     */
    void reserve(uint64_t rows, uint64_t bytes_held);

    /// One value per column, in their order; a packed colour is given as the number 0xRRGGBB.
    void add_row(const double* values);

    /// The colours of a text turn out to be whole numbers or not only while reading.
    void set_colours_are_integers(bool yes) { colours_are_integers_ = yes; }
    bool has_colours() const { return packed_ >= 0 || colour_[0] >= 0; }
    bool is_colour(size_t column) const;

    RawCloud finish(const std::string& kind);

 private:
    void note_columns_without_place(const std::vector<CloudColumn>& columns);
    void scale_colours();

    std::string source_;
    int xyz_[3] = {-1, -1, -1};  // columns; -1: there is none
    int intensity_ = -1;
    int colour_[3] = {-1, -1, -1};
    int packed_ = -1;
    bool colours_are_integers_ = true;
    RawCloud cloud_;
};

/// The offset in a comment as save_map() writes it: `coordinate_offset X Y Z`, whole numbers. Empty if it is
/// none.
std::optional<mrpt::math::TPoint3D> offset_in_comment(std::string_view comment);
std::string offset_as_comment(const mrpt::math::TPoint3D& offset);

}  // namespace mp2p_icp
