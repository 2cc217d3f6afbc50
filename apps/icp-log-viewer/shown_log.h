#pragma once

#include <mp2p_icp/log_scene.h>

#include <memory>
#include <string>
#include <vector>

namespace mp2p_icp_apps
{
/// One log (or a map) that is on show: its scene, and at which of its moments it stands. No window here.
class ShownLog
{
 public:
    /// \param log null if it cannot be read; `problem` then says why
    ShownLog(const std::string& path, const mp2p_icp::LogRecord::Ptr& log, const std::string& problem);
    ShownLog(const std::string& path, const mp2p_icp::metric_map_t::ConstPtr& map);

    const std::string& path() const { return path_; }
    std::string file_name() const;
    const std::string& problem() const { return problem_; }  ///< empty: none
    mp2p_icp::LogScene* scene() { return scene_.get(); }     ///< null if there is nothing to show
    const mp2p_icp::LogRecord* log() const { return scene_ ? scene_->log() : nullptr; }

    const std::vector<mp2p_icp::LogMoment>& moments() const { return moments_; }
    size_t moment_index() const { return moment_index_; }
    /// As far as there are moments; a pose that is not finite becomes a problem, and stays where it was.
    void go_to_moment(long index);
    void step(long by) { go_to_moment(static_cast<long>(moment_index_) + by); }
    bool at_last_moment() const { return moment_index_ + 1 >= moments_.size(); }

 private:
    std::string path_, problem_;
    std::unique_ptr<mp2p_icp::LogScene> scene_;
    std::vector<mp2p_icp::LogMoment> moments_;
    size_t moment_index_ = 0;
};

}  // namespace mp2p_icp_apps
