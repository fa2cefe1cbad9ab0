#include "cli/request/filter_words.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <string_view>

#include "settings/kernel.hpp"

namespace edgewise::cli {

std::string meant_by_filter_option(const std::string& option, const std::string& value) {
    const std::string name = option.substr(std::min(option.size(), option.find_first_not_of('-')));
    const bool is_size = !value.empty() && std::string_view("0123456789.").find(value.front()) !=
                                               std::string_view::npos;
    const std::string plain = plain_op_name(name);
    const auto size = [&](const char* otherwise) { return is_size ? value : otherwise; };
    if (plain == "sigma") return fmt::format("--op convolve --kernel gauss:{}", size("S"));
    if (plain == "radius" || plain == "size") return fmt::format("--kernel box:{}", size("R"));
    if (plain == "laplace" || plain == "laplacian") return "--op convolve --kernel laplace";
    if (plain == "sobel") return "--op correlate --kernel sobel:x";
    if (const NamedSum* sum = named_sum(name))
        return fmt::format("--op convolve --kernel {}", sum->kind == KernelSpec::Kind::gauss
                                                            ? "gauss:" + size("S")
                                                            : "box:" + size("R"));
    for (const KernelName& known : kKernelNames)
        if (plain == known.name) return fmt::format("--kernel {}:{}", known.name, size("R"));
    for (const FilterOp op : filter_ops()) {
        if (plain != name_of(op)) continue;
        if (op == FilterOp::gradient)
            return fmt::format("--op gradient --kernel gauss:{}", size("S"));
        if (is_linear(op)) return fmt::format("--op {} --kernel KERNEL", plain);
        return fmt::format("--op {} --kernel {}:{}", plain,
                           op == FilterOp::median ? "box" : "sphere", size("R"));
    }
    return {};
}

}  // namespace edgewise::cli
