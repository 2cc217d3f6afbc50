#pragma once

#include <mp2p_icp/Pairings.h>
#include <mp2p_icp/metricmap.h>
#include <mrpt/poses/CPose3D.h>
#include <mrpt/poses/CPose3DPDFGaussianInf.h>

namespace mp2p_icp
{
/** Between the coordinates in which two maps are stored and their original ones: p_original = p_stored +
 * offset, in each map. Without offsets every function returns its argument, to the bit.
 */
class MapOffsets
{
 public:
    MapOffsets(const metric_map_t& local, const metric_map_t& global)
        : local_(local.coordinate_offset()), global_(global.coordinate_offset())
    {
    }

    bool none() const
    {
        return local_ == mrpt::math::TPoint3D(0, 0, 0) && global_ == mrpt::math::TPoint3D(0, 0, 0);
    }
    const mrpt::math::TPoint3D& global() const { return global_; }

    mrpt::poses::CPose3D to_stored(const mrpt::poses::CPose3D& original) const;
    mrpt::poses::CPose3D to_original(const mrpt::poses::CPose3D& stored) const;
    mrpt::poses::CPose3DPDFGaussianInf to_stored(const mrpt::poses::CPose3DPDFGaussianInf& original) const;
    Pairings to_original(Pairings stored) const;
    Pairings to_stored(Pairings original) const;

 private:
    mrpt::math::TPoint3D local_, global_;
};

/// The pairings with each side moved by so much; weights stay.
Pairings shifted(Pairings pairings, const mrpt::math::TVector3D& local, const mrpt::math::TVector3D& global);

}  // namespace mp2p_icp
