#include "icp_log_viewer.h"

#include <mp2p_icp/errors.h>

#include <algorithm>
#include <new>
#include <ostream>

#include "log_pictures.h"
#include "viewer_window.h"

namespace mp2p_icp_apps
{
namespace
{
int complain(std::ostream& err, std::string reason)
{
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    err << "icp-log-viewer: " << reason << std::endl;
    return 1;
}

void run(const ViewerOptions& options, std::ostream& out)
{
    if (options.wants_pictures())
        write_pictures(options, out);
    else
        open_viewer_window(options, out);
}
}  // namespace

int icp_log_viewer(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& err) noexcept
{
    try
    {
        if (const auto options = parse_viewer_options(arguments, out); options) run(*options, out);
        return 0;
    }
    catch (const std::bad_alloc&)
    {
        return complain(err, "not enough memory");
    }
    catch (const std::exception& e)
    {
        return complain(err, mp2p_icp::short_reason(e));
    }
    catch (...)
    {
        return complain(err, "unknown error");
    }
}

}  // namespace mp2p_icp_apps
