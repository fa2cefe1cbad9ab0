#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace edgewise::thesis {

using Row = std::map<std::string, std::string>;

inline std::vector<std::string> cells(const std::string& line) {
    std::vector<std::string> all(1);
    for (const char c : line)
        if (c == ',')
            all.emplace_back();
        else if (c != '\r')
            all.back() += c;
    return all;
}

/// A file of comma separated values beside this one; lines that begin with # are skipped, the first
/// other one names the columns. No cell holds a comma.
inline std::vector<Row> rows_of(const std::string& name) {
    const char* tests = std::getenv("EDGEWISE_TESTS");
    std::ifstream file(std::filesystem::path(tests ? tests : "tests") / "thesis" / name);
    if (!file) throw std::runtime_error("cannot read " + name);
    std::vector<std::string> columns;
    std::vector<Row> rows;
    for (std::string line; std::getline(file, line);) {
        if (line.empty() || line[0] == '#') continue;
        const std::vector<std::string> values = cells(line);
        if (columns.empty()) {
            columns = values;
            continue;
        }
        Row row;
        for (std::size_t i = 0; i < columns.size() && i < values.size(); ++i)
            row[columns[i]] = values[i];
        rows.push_back(row);
    }
    return rows;
}

/// A table of [W93], as printed: tables/tableNN.csv.
inline std::vector<Row> table(int number) {
    const std::string digits = std::to_string(number);
    return rows_of("tables/table" + (digits.size() < 2 ? "0" + digits : digits) + ".csv");
}

}  // namespace edgewise::thesis
