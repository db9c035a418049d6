// SPDX-License-Identifier: Apache-2.0
// Makes NetCDF files by the library, for the tests of their reader.
#pragma once
#include <gtest/gtest.h>
#include <netcdf.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace scolopax::io {

struct NetcdfDim {
  std::string name;
  std::size_t length;
};

/// Makes a file; values are given as doubles and stored as the variable's type.
class NetcdfMaker {
 public:
  NetcdfMaker(const std::filesystem::path& path, int mode) {
    check(nc_create(path.c_str(), mode | NC_CLOBBER, &file_));
  }
  ~NetcdfMaker() { check(nc_close(file_)); }
  NetcdfMaker(const NetcdfMaker&) = delete;
  NetcdfMaker& operator=(const NetcdfMaker&) = delete;

  void variable(const std::string& name, nc_type type, const std::vector<NetcdfDim>& dims,
                const std::vector<double>& values) {
    std::vector<int> ids;
    for (const NetcdfDim& dim : dims) {
      int id = -1;
      if (nc_inq_dimid(file_, dim.name.c_str(), &id) != NC_NOERR)
        check(nc_def_dim(file_, dim.name.c_str(), dim.length, &id));
      ids.push_back(id);
    }
    check(nc_def_var(file_, name.c_str(), type, int(ids.size()), ids.data(), &ids_[name]));
    values_[name] = values;
  }
  void attribute(const std::string& name, const char* attribute, const std::string& text) {
    check(nc_put_att_text(file_, idOf(name), attribute, text.size(), text.c_str()));
  }
  void attribute(const std::string& name, const char* attribute, nc_type type, double number) {
    check(nc_put_att_double(file_, idOf(name), attribute, type, 1, &number));
  }
  /// After all definitions.
  void write() {
    check(nc_enddef(file_));
    for (const auto& [name, values] : values_)
      if (!values.empty()) check(nc_put_var_double(file_, ids_[name], values.data()));
  }

 private:
  static void check(int status) { EXPECT_EQ(status, NC_NOERR) << nc_strerror(status); }
  int idOf(const std::string& name) { return name.empty() ? NC_GLOBAL : ids_.at(name); }

  int file_ = -1;
  std::map<std::string, int> ids_;
  std::map<std::string, std::vector<double>> values_;
};

inline std::vector<double> netcdfRamp(std::size_t count) {
  std::vector<double> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = double(i);
  return values;
}

inline const std::vector<NetcdfDim> kZyx{{"z", 2}, {"y", 3}, {"x", 4}};

}  // namespace scolopax::io
