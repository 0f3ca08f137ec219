// Numbers and attributes of netCDF files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace twilight {

/// What netCDF stores a variable's numbers as.
enum class NetcdfType { kFloat, kDouble, kText, kInteger };

/// A netCDF file being read (classic or netCDF-4). Every complaint is a std::runtime_error that
/// names the file and the variable, dimension or attribute.
class NetcdfReader {
 public:
  /// `what` names the kind of file in complaints: "field", "must be ..." may follow.
  explicit NetcdfReader(const std::filesystem::path& path, std::string_view what = "netCDF file");
  ~NetcdfReader();
  NetcdfReader(const NetcdfReader&) = delete;
  NetcdfReader& operator=(const NetcdfReader&) = delete;

  const std::string& name() const { return name_; }
  /// Throws "FILE: WHAT".
  [[noreturn]] void refuse(std::string_view what) const;
  /// Throws "FILE: variable 'NAME' WHAT".
  [[noreturn]] void refuse_variable(std::string_view variable, std::string_view what) const;

  /// Length of a dimension; 0 where the file has none of this name.
  std::size_t size(std::string_view dimension) const;
  bool has_variable(std::string_view variable) const;
  /// Of every variable, in the order of the file.
  std::vector<std::string> variables() const;

  /// Names of a variable's dimensions, slowest first.
  std::vector<std::string> dimensions(std::string_view variable) const;
  NetcdfType type(std::string_view variable) const;
  /// All numbers of a variable, converted, row-major; refused where the file's bytes cannot hold
  /// them, or where one is not finite (`finite`).
  std::vector<double> numbers(std::string_view variable, bool finite = true) const;
  std::vector<float> floats(std::string_view variable, bool finite = true) const;
  /// numbers(), refused unless the variable has these dimensions.
  std::vector<double> numbers(std::string_view variable,
                              const std::vector<std::string>& dimensions) const;

  /// Attributes of a variable, of the file where `variable` is empty; nothing where there is none
  /// of this name and kind.
  std::optional<std::string> text_attribute(std::string_view variable, std::string_view name) const;
  std::optional<double> number_attribute(std::string_view variable, std::string_view name) const;
  /// The same, refused where there is none.
  std::string required_text(std::string_view variable, std::string_view name) const;
  double required_number(std::string_view variable, std::string_view name) const;

 private:
  int id_of(std::string_view variable) const;
  template <class Number>
  std::vector<Number> read(std::string_view variable, bool finite) const;

  std::string name_;
  std::uintmax_t bytes_ = 0;
  int id_ = -1;
};

}  // namespace twilight
