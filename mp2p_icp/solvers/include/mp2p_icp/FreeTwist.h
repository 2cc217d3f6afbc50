#pragma once

#include <mrpt/math/TPoint3D.h>

#include <cstdint>
#include <string>

namespace mp2p_icp
{
/// A motion, with how well pairings determine it. If they do not, their residuals do not change along it.
struct FreeTwist
{
    enum class Kind : uint8_t
    {
        Translation,
        Rotation,
        Screw
    };
    Kind kind = Kind::Translation;
    mrpt::math::TVector3D axis;  ///< unit vector, global frame
    mrpt::math::TPoint3D
        through;       ///< a point of the rotation or screw axis, global frame, m; zero for a translation
    double pitch = 0;  ///< of a screw: advance along the axis per turn, m/rad
    double sigma =
        0;  ///< predicted standard deviation along it: m for a translation, rad otherwise; may be infinite
    /// Its information relative to that of the best determined motion, 1 rad counting as the rms radius of
    /// the paired points. Rounding leaves some 1e-16; a curved scene (sphere, tunnel) the square of its
    /// noise.
    double information_ratio = 0;
    std::string name;  ///< `x y z` (translation) or `roll pitch yaw` (rotation) when within 5 degrees of that
                       ///< axis; else empty
};
/// `translation`, `rotation` or `screw`; empty for a number that is none of them.
std::string to_string(FreeTwist::Kind kind);

}  // namespace mp2p_icp
