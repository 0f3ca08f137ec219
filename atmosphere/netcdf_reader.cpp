#include "atmosphere/netcdf_reader.h"

#include <netcdf.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace twilight {
namespace {

namespace fs = std::filesystem;

std::string joined(const std::vector<std::string>& words) {
  std::string all;
  for (const std::string& word : words) all += (all.empty() ? "" : ", ") + word;
  return all;
}

int get(int file, int variable, std::vector<float>& v) {
  return nc_get_var_float(file, variable, v.data());
}
int get(int file, int variable, std::vector<double>& v) {
  return nc_get_var_double(file, variable, v.data());
}

// Bytes of all variables of a file.
double promised_bytes(int file) {
  double bytes = 0.0;
  int variables = 0;
  nc_inq_nvars(file, &variables);
  for (int v = 0; v < variables; ++v) {
    nc_type type = NC_NAT;
    std::size_t size = 0;
    int dimensions = 0;
    nc_inq_vartype(file, v, &type);
    nc_inq_type(file, type, nullptr, &size);
    nc_inq_varndims(file, v, &dimensions);
    std::vector<int> ids(static_cast<std::size_t>(dimensions));
    nc_inq_vardimid(file, v, ids.data());
    double count = static_cast<double>(size);
    for (const int d : ids) {
      std::size_t length = 0;
      nc_inq_dimlen(file, d, &length);
      count *= static_cast<double>(length);
    }
    bytes += count;
  }
  return bytes;
}

}  // namespace

NetcdfReader::NetcdfReader(const fs::path& path, std::string_view what) : name_(path.string()) {
  if (!fs::is_regular_file(path)) {
    throw std::runtime_error(name_ + ": cannot read this " + std::string(what) + ": no such file");
  }
  bytes_ = fs::file_size(path);
  const int status = nc_open(path.c_str(), NC_NOWRITE, &id_);
  if (status != NC_NOERR) {
    throw std::runtime_error(name_ + ": cannot read this " + std::string(what) +
                             ", which must be netCDF: " + nc_strerror(status));
  }
  // The library reads zeros behind the end of a file that was cut short. Without a table of where
  // variables begin, at least their bytes must be there; netCDF-4 keeps watch itself.
  int format = 0;
  if (nc_inq_format(id_, &format) != NC_NOERR || format == NC_FORMAT_NETCDF4 ||
      format == NC_FORMAT_NETCDF4_CLASSIC || promised_bytes(id_) <= static_cast<double>(bytes_)) {
    return;
  }
  nc_close(id_);
  throw std::runtime_error(name_ + ": was cut short: its " + std::to_string(bytes_) +
                           " bytes cannot hold its variables");
}

NetcdfReader::~NetcdfReader() { nc_close(id_); }

void NetcdfReader::refuse(std::string_view what) const {
  throw std::runtime_error(name_ + ": " + std::string(what));
}

void NetcdfReader::refuse_variable(std::string_view variable, std::string_view what) const {
  refuse("variable '" + std::string(variable) + "' " + std::string(what));
}

std::size_t NetcdfReader::size(std::string_view dimension) const {
  int id = 0;
  std::size_t length = 0;
  if (nc_inq_dimid(id_, std::string(dimension).c_str(), &id) != NC_NOERR) return 0;
  return nc_inq_dimlen(id_, id, &length) == NC_NOERR ? length : 0;
}

bool NetcdfReader::has_variable(std::string_view variable) const {
  int id = 0;
  return nc_inq_varid(id_, std::string(variable).c_str(), &id) == NC_NOERR;
}

std::vector<std::string> NetcdfReader::variables() const {
  int count = 0;
  if (nc_inq_nvars(id_, &count) != NC_NOERR) refuse("its variables cannot be listed");
  std::vector<std::string> names;
  for (int v = 0; v < count; ++v) {
    char name[NC_MAX_NAME + 1] = {};
    if (nc_inq_varname(id_, v, name) == NC_NOERR) names.emplace_back(name);
  }
  return names;
}

int NetcdfReader::id_of(std::string_view variable) const {
  int id = 0;
  if (nc_inq_varid(id_, std::string(variable).c_str(), &id) != NC_NOERR) {
    refuse_variable(variable, "is missing");
  }
  return id;
}

std::vector<std::string> NetcdfReader::dimensions(std::string_view variable) const {
  const int id = id_of(variable);
  int count = 0;
  std::vector<std::string> names;
  if (nc_inq_varndims(id_, id, &count) != NC_NOERR) refuse_variable(variable, "is damaged");
  std::vector<int> ids(static_cast<std::size_t>(count));
  if (nc_inq_vardimid(id_, id, ids.data()) != NC_NOERR) refuse_variable(variable, "is damaged");
  for (const int dimension : ids) {
    char name[NC_MAX_NAME + 1] = {};
    nc_inq_dimname(id_, dimension, name);
    names.emplace_back(name);
  }
  return names;
}

NetcdfType NetcdfReader::type(std::string_view variable) const {
  nc_type type = NC_NAT;
  if (nc_inq_vartype(id_, id_of(variable), &type) != NC_NOERR) {
    refuse_variable(variable, "is damaged");
  }
  if (type == NC_FLOAT) return NetcdfType::kFloat;
  if (type == NC_DOUBLE) return NetcdfType::kDouble;
  return type == NC_CHAR || type == NC_STRING ? NetcdfType::kText : NetcdfType::kInteger;
}

template <class Number>
std::vector<Number> NetcdfReader::read(std::string_view variable, bool finite) const {
  const int id = id_of(variable);
  const NetcdfType stored = type(variable);
  if (stored == NetcdfType::kText) refuse_variable(variable, "holds text: must hold numbers");
  // A damaged header may promise more than the file holds; no stored number takes less than this
  // but for compressed ones, of which none shrinks a thousandfold.
  constexpr double kLeastBytes = 1e-3;
  double count = 1;
  for (const std::string& d : dimensions(variable)) count *= static_cast<double>(size(d));
  if (count * kLeastBytes > static_cast<double>(bytes_) + 1) {
    refuse_variable(variable, "is damaged: the file's " + std::to_string(bytes_) +
                                  " bytes cannot hold its values");
  }
  std::vector<Number> values(static_cast<std::size_t>(count));
  if (const int status = get(id_, id, values); status != NC_NOERR) {
    refuse_variable(variable, std::string("cannot be read: ") + nc_strerror(status));
  }
  if (finite && !std::ranges::all_of(values, [](Number v) { return std::isfinite(v); })) {
    refuse_variable(variable, "holds a value that is not finite");
  }
  return values;
}

std::vector<double> NetcdfReader::numbers(std::string_view variable, bool finite) const {
  return read<double>(variable, finite);
}

std::vector<float> NetcdfReader::floats(std::string_view variable, bool finite) const {
  return read<float>(variable, finite);
}

std::vector<double> NetcdfReader::numbers(std::string_view variable,
                                          const std::vector<std::string>& wanted) const {
  const std::vector<std::string> held = dimensions(variable);
  if (held != wanted) {
    refuse_variable(
        variable, "has the dimensions (" + joined(held) + "): must have (" + joined(wanted) + ")");
  }
  return numbers(variable);
}

std::optional<std::string> NetcdfReader::text_attribute(std::string_view variable,
                                                        std::string_view name) const {
  const int id = variable.empty() ? NC_GLOBAL : id_of(variable);
  const std::string attribute(name);
  nc_type type = NC_NAT;
  std::size_t length = 0;
  if (nc_inq_att(id_, id, attribute.c_str(), &type, &length) != NC_NOERR || type != NC_CHAR) {
    return std::nullopt;
  }
  std::string value(length, '\0');
  if (nc_get_att_text(id_, id, attribute.c_str(), value.data()) != NC_NOERR) return std::nullopt;
  return value;
}

std::optional<double> NetcdfReader::number_attribute(std::string_view variable,
                                                     std::string_view name) const {
  const int id = variable.empty() ? NC_GLOBAL : id_of(variable);
  const std::string attribute(name);
  std::size_t length = 0;
  double value = 0;
  if (nc_inq_attlen(id_, id, attribute.c_str(), &length) != NC_NOERR || length != 1 ||
      nc_get_att_double(id_, id, attribute.c_str(), &value) != NC_NOERR || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

std::string NetcdfReader::required_text(std::string_view variable, std::string_view name) const {
  if (auto value = text_attribute(variable, name)) return *value;
  refuse((variable.empty() ? "global" : "variable '" + std::string(variable) + "':") +
         " attribute '" + std::string(name) + "' is missing or no text");
}

double NetcdfReader::required_number(std::string_view variable, std::string_view name) const {
  if (const auto value = number_attribute(variable, name)) return *value;
  refuse((variable.empty() ? "global" : "variable '" + std::string(variable) + "':") +
         " attribute '" + std::string(name) + "' is missing or no finite number");
}

}  // namespace twilight
