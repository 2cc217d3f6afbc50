#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace mp2p_icp
{
/** \file errors.h
 * The three kinds of trouble, and how each one is told:
 *  - the caller's mistake: std::invalid_argument (ConfigError when it stands in a YAML file), naming the
 * argument and the rule it breaks;
 *  - bad data (a damaged file, ...): DataError, naming the source, the place, what was expected and what was
 * found. Single bad points are not an error: they are dropped, counted and reported;
 *  - an alignment that cannot be trusted: no exception at all, but Results::verdict.
 */

/// A mistake in a configuration. what() reads `file:line: path.to.key: the rule that was broken`.
class ConfigError : public std::invalid_argument
{
 public:
    using std::invalid_argument::invalid_argument;
};

/// Data that cannot be read. what() reads `source, place: expected X, found Y`.
class DataError : public std::runtime_error
{
 public:
    /// \param source a file name or the like
    /// \param place e.g. `line 12` or `byte 1024`; may be empty
    DataError(const std::string& source, const std::string& place, const std::string& expected,
              const std::string& found);

    /// For problems that are not of the expected/found form.
    DataError(const std::string& source, const std::string& problem);
};

/// `byte N`, for DataError::place.
std::string place_byte(uint64_t offset);
/// `line N` (1-based), for DataError::place.
std::string place_line(uint64_t line);

/// The first useful line of an exception's text, without MRPT's source locations and call stacks.
std::string short_reason(const std::exception& e);

}  // namespace mp2p_icp
