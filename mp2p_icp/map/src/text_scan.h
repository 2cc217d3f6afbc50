#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mp2p_icp
{
/// Goes through a text line by line. Lines end with LF or CR LF; the last one may lack its end.
class LineScanner
{
 public:
    explicit LineScanner(std::string_view text) : text_(text) {}

    /// The next line without its end; false at the end of the text.
    bool next(std::string_view& line);

    uint64_t line_number() const { return number_; }  ///< of the line that next() gave last, from 1
    size_t position() const { return at_; }           ///< bytes before the line that comes next
    std::string_view rest() const { return text_.substr(at_); }

 private:
    std::string_view text_;
    size_t at_ = 0;
    uint64_t number_ = 0;
};

enum class Separators
{
    Blanks,          ///< blanks and tabs
    BlanksAndCommas  ///< also one comma or semicolon; nothing between two of them is an empty word
};

/** Splits a line into its words, at most `max_words` of them (a hostile line must not need memory many times
 * its size). \return false if there are more.
 */
bool split_words(std::string_view line, Separators separators, std::vector<std::string_view>& words,
                 size_t max_words = 4096);

/// A number whatever the locale; `nan`, `inf` and what Windows prints for them are understood. Empty if it is
/// none.
std::optional<double> parse_number(std::string_view word);

/// A whole number from 0 to 2^64-1. Empty if it is none.
std::optional<uint64_t> parse_count(std::string_view word);

/// For messages: quoted, without control characters, cut when long.
std::string shown(std::string_view text);

}  // namespace mp2p_icp
