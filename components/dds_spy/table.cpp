#include "components/dds_spy/table.hpp"

#include <algorithm>

#include "common/core/utf8.hpp"

namespace phantom::dds_spy {
Table::Table(std::vector<std::string> headings) : headings_(std::move(headings)) {
  for (std::string& heading : headings_) {
    right_.push_back(heading.starts_with('>'));
    if (right_.back()) heading.erase(0, 1);
  }
}

std::string Table::text() const {
  std::vector<std::size_t> widths(headings_.size());
  for (std::size_t c = 0; c < headings_.size(); ++c) {
    widths[c] = core::columns_of(headings_[c]);
    for (const auto& row : rows_) widths[c] = std::max(widths[c], core::columns_of(row[c]));
  }
  std::string text;
  const auto append = [&](const std::vector<std::string>& row) {
    std::string line;
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::string blanks(widths[c] - core::columns_of(row[c]), ' ');
      line += (c == 0 ? "" : "  ") + (right_[c] ? blanks + row[c] : row[c] + blanks);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  };
  append(headings_);
  for (const auto& row : rows_) append(row);
  return text;
}

}  // namespace phantom::dds_spy
