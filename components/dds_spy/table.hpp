#pragma once

#include <cstddef>
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

/// Returns the terminal columns of the text, if every character takes one.
std::size_t width_of(const std::string& text);
/// Returns the text's first `columns` characters.
std::string cut_to(const std::string& text, std::size_t columns);

}  // namespace phantom::dds_spy
