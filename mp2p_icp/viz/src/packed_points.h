#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <string>
#include <vector>

#include "html_text.h"

namespace mp2p_icp
{
/// Points as the page's script reads them: base64 of float x, y, z, one after the other.
class PackedPoints
{
 public:
    void reserve(size_t points) { numbers_.reserve(3 * points); }

    /// Points, such as the two of a segment. Leaves all of them out if one of them is not finite as float.
    template <class... Point>
    void add(const Point&... points)
    {
        if ((points.template cast<float>().allFinite() && ...)) (append(points), ...);
    }

    bool empty() const { return numbers_.empty(); }
    size_t size() const { return numbers_.size() / 3; }
    std::string json() const { return '"' + base64(numbers_.data(), numbers_.size() * sizeof(float)) + '"'; }

 private:
    void append(const Eigen::Vector3d& p)
    {
        for (int i = 0; i < 3; i++) numbers_.push_back(static_cast<float>(p(i)));
    }

    std::vector<float> numbers_;
};

}  // namespace mp2p_icp
