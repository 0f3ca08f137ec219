#include "output/netcdf_writer.h"

#include <netcdf.h>

#include <algorithm>

namespace twilight {

NetcdfWriter::NetcdfWriter(AtomicFile& file) : file_(file) {
  check(nc_create(file.temporary().c_str(), NC_CLOBBER | NC_64BIT_DATA, &id_));
  open_ = true;
  // No need to fill with blanks what is written anyway.
  check(nc_set_fill(id_, NC_NOFILL, nullptr));
}

NetcdfWriter::~NetcdfWriter() {
  if (open_) nc_close(id_);
}

void NetcdfWriter::check(int status) const {
  if (status != NC_NOERR) file_.fail(nc_strerror(status));
}

void NetcdfWriter::dimension(const std::string& name, std::size_t size) {
  check(nc_def_dim(id_, name.c_str(), size, &dimension_[name]));
}

void NetcdfWriter::variable(const std::string& name, NetcdfNumber type,
                            const std::vector<std::string>& dimensions,
                            const NetcdfMeaning& meaning, const double* blank) {
  std::vector<int> ids;
  for (const std::string& dimension : dimensions) ids.push_back(dimension_.at(dimension));
  int& id = variable_[name];
  const nc_type stored = type == NetcdfNumber::kFloat ? NC_FLOAT : NC_DOUBLE;
  check(nc_def_var(id_, name.c_str(), stored, static_cast<int>(ids.size()), ids.data(), &id));
  if (blank != nullptr) {
    check(nc_put_att_double(id_, id, "_FillValue", stored, 1, blank));
    check(nc_def_var_fill(id_, id, 0, nullptr));
  }
  attribute(name, "units", meaning.units);
  attribute(name, "long_name", meaning.long_name);
  attribute(name, "standard_name", meaning.standard_name);
}

void NetcdfWriter::words(const std::string& name, const std::string& along, std::size_t longest,
                         const NetcdfMeaning& meaning) {
  longest_word_[name] = std::max<std::size_t>(1, longest);
  dimension(name + "_length", longest_word_[name]);
  const int ids[] = {dimension_.at(along), dimension_.at(name + "_length")};
  check(nc_def_var(id_, name.c_str(), NC_CHAR, 2, ids, &variable_[name]));
  attribute(name, "long_name", meaning.long_name);
  attribute(name, "standard_name", meaning.standard_name);
}

void NetcdfWriter::attribute(const std::string& variable, const char* name,
                             std::string_view value) {
  if (value.empty()) return;
  const int id = variable.empty() ? NC_GLOBAL : variable_.at(variable);
  check(nc_put_att_text(id_, id, name, value.size(), value.data()));
}

void NetcdfWriter::attribute(const std::string& variable, const char* name, double value) {
  const int id = variable.empty() ? NC_GLOBAL : variable_.at(variable);
  check(nc_put_att_double(id_, id, name, NC_DOUBLE, 1, &value));
}

void NetcdfWriter::attribute(const std::string& variable, const char* name, int value) {
  const int id = variable.empty() ? NC_GLOBAL : variable_.at(variable);
  check(nc_put_att_int(id_, id, name, NC_INT, 1, &value));
}

void NetcdfWriter::end_definitions() { check(nc_enddef(id_)); }

void NetcdfWriter::put(const std::string& variable, std::span<const double> values) {
  check(nc_put_var_double(id_, variable_.at(variable), values.data()));
}

void NetcdfWriter::put(const std::string& variable, std::span<const float> values) {
  check(nc_put_var_float(id_, variable_.at(variable), values.data()));
}

void NetcdfWriter::put(const std::string& variable, const std::vector<std::string>& words) {
  const std::size_t length = longest_word_.at(variable);
  std::string all(words.size() * length, '\0');
  for (std::size_t i = 0; i < words.size(); ++i) {
    words[i].copy(all.data() + i * length, std::min(length, words[i].size()));
  }
  check(nc_put_var_text(id_, variable_.at(variable), all.data()));
}

void NetcdfWriter::put(const std::string& variable, const std::vector<std::size_t>& start,
                       const std::vector<std::size_t>& count, std::span<const double> values) {
  check(nc_put_vara_double(id_, variable_.at(variable), start.data(), count.data(), values.data()));
}

void NetcdfWriter::close() {
  open_ = false;
  check(nc_close(id_));
}

}  // namespace twilight
