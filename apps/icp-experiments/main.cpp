#include <unistd.h>

#include <iostream>
#include <string>
#include <vector>

#include "icp_experiments.h"

int main(int argc, char** argv)
{
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    const bool is_terminal = isatty(STDERR_FILENO) == 1;
    return mp2p_icp_apps::icp_experiments(arguments, {std::cout, std::cerr, is_terminal});
}
