#pragma once

#include <fstream>
#include <string>
#include <vector>

namespace mp2p_icp_apps::experiments
{
/// A column of a CSV file, and what the summary says of it.
struct Column
{
    std::string name;  ///< with its unit at the end
    std::string help;
};

/** A CSV file (commas, one line of names first, `.` as decimal point, 7 significant digits), written row by
 * row. \exception mp2p_icp::DataError if it cannot be written.
 */
class CsvFile
{
 public:
    CsvFile(const std::string& path, const std::vector<Column>& columns);

    CsvFile& operator<<(const std::string& text);  ///< without comma or quote
    CsvFile& operator<<(double value);
    CsvFile& operator<<(size_t value);
    CsvFile& operator<<(bool value) { return *this << (value ? "1" : "0"); }
    CsvFile& operator<<(const char* text) { return *this << std::string(text); }
    void end_row();  ///< \exception std::logic_error unless every column was given
    void close();

 private:
    std::string path_;
    size_t columns_, given_ = 0;
    std::ofstream out_;
};

}  // namespace mp2p_icp_apps::experiments
