#include <iostream>
#include <string>
#include <vector>

#include "icp_log_viewer.h"

int main(int argc, char** argv)
{
    return mp2p_icp_apps::icp_log_viewer({argv + 1, argv + argc}, std::cout, std::cerr);
}
