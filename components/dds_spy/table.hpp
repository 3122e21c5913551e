#pragma once

#include <string>
#include <vector>

namespace phantom::dds_spy {

/// Formats columns of text, each as wide as its widest cell, with two spaces between. Widths are counted in
/// UTF-8 characters.
class Table {
 public:
  /// A heading that begins with '>' marks a column of numbers, which is aligned to the right.
  explicit Table(std::vector<std::string> headings);
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  bool empty() const { return rows_.empty(); }
  std::string text() const;

 private:
  std::vector<std::string> headings_;
  std::vector<bool> right_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace phantom::dds_spy
