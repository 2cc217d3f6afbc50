#include "csv_file.h"

#include <mp2p_icp/errors.h>

#include <stdexcept>

#include "number_text.h"

namespace mp2p_icp_apps::experiments
{
CsvFile::CsvFile(const std::string& path, const std::vector<Column>& columns)
    : path_(path), columns_(columns.size()), out_(path, std::ios::binary)
{
    if (!out_) throw mp2p_icp::DataError(path_, "cannot be written");
    for (const auto& column : columns) *this << column.name;
    end_row();
}

CsvFile& CsvFile::operator<<(const std::string& text)
{
    if (text.find_first_of(",\"\n") != std::string::npos)
        throw std::logic_error("CsvFile: '" + text + "' needs quotes");
    out_ << (given_++ ? "," : "") << text;
    return *this;
}
CsvFile& CsvFile::operator<<(double value)
{
    return *this << number_text(value);
}
CsvFile& CsvFile::operator<<(size_t value)
{
    return *this << std::to_string(value);
}

void CsvFile::end_row()
{
    if (given_ != columns_)
        throw std::logic_error("CsvFile: " + std::to_string(given_) + " values for " +
                               std::to_string(columns_) + " columns");
    out_ << "\n";
    given_ = 0;
}

void CsvFile::close()
{
    out_.close();
    if (!out_) throw mp2p_icp::DataError(path_, "cannot be written");
}

}  // namespace mp2p_icp_apps::experiments
