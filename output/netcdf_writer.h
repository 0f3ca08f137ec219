// netCDF files written after the CF conventions.
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "output/atomic_file.h"

namespace twilight {

enum class NetcdfNumber { kFloat, kDouble };

/// What CF wants to know of a variable; an empty text is left out.
struct NetcdfMeaning {
  std::string units = {}, long_name = {}, standard_name = {};
};

/// A netCDF file (64-bit data, CDF-5, which holds no time stamp) being written into an AtomicFile,
/// whose commit is the caller's, after close(). First dimensions, variables and attributes, then
/// end_definitions(), then numbers: whole variables or slabs of them, in any order, each once.
/// What fails is thrown as AtomicFile::fail does.
class NetcdfWriter {
 public:
  explicit NetcdfWriter(AtomicFile& file);
  ~NetcdfWriter();
  NetcdfWriter(const NetcdfWriter&) = delete;
  NetcdfWriter& operator=(const NetcdfWriter&) = delete;

  void dimension(const std::string& name, std::size_t size);
  /// A variable of dimensions defined before (none: one number). `blank`: what is not written
  /// reads as this (_FillValue); without it everything must be written.
  void variable(const std::string& name, NetcdfNumber type,
                const std::vector<std::string>& dimensions, const NetcdfMeaning& meaning,
                const double* blank = nullptr);
  /// Words, as characters along a dimension "NAME_length" that this makes; put() with words.
  void words(const std::string& name, const std::string& dimension, std::size_t longest,
             const NetcdfMeaning& meaning);

  /// Attributes of a variable, of the file where `variable` is empty. An empty text is left out.
  void attribute(const std::string& variable, const char* name, std::string_view value);
  void attribute(const std::string& variable, const char* name, double value);
  void attribute(const std::string& variable, const char* name, int value);

  void end_definitions();

  void put(const std::string& variable, std::span<const double> values);
  void put(const std::string& variable, std::span<const float> values);
  void put(const std::string& variable, const std::vector<std::string>& words);
  /// A slab: from `start`, `count` along every dimension.
  void put(const std::string& variable, const std::vector<std::size_t>& start,
           const std::vector<std::size_t>& count, std::span<const double> values);

  void close();

 private:
  void check(int status) const;

  AtomicFile& file_;
  int id_ = -1;
  bool open_ = false;
  std::map<std::string, int, std::less<>> dimension_, variable_;
  std::map<std::string, std::size_t, std::less<>> longest_word_;
};

}  // namespace twilight
