#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace phantom::dds_spy {

/// Columns of text that are as wide as their widest cell, two blanks between; the widths are counted in UTF-8
/// characters.
class Table {
 public:
  /// A heading that begins with '>' is of a column of numbers, aligned to the right.
  explicit Table(std::vector<std::string> headings);
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  bool empty() const { return rows_.empty(); }
  std::string text() const;

 private:
  std::vector<std::string> headings_;
  std::vector<bool> right_;
  std::vector<std::vector<std::string>> rows_;
};

/// Columns that the text takes on a terminal, if every character takes one.
std::size_t width_of(const std::string& text);
/// The text's first `columns` characters.
std::string cut_to(const std::string& text, std::size_t columns);

}  // namespace phantom::dds_spy
