// The product C of two matrices: backward, forward, by a kept BLAS where there is one, or by
// blocks, which need a layout of their own. Through the spectrum: product_by_transform.cpp.
//
//   matrix/factors --backward, forward, blas--> matrix/product
//        \-----cut----> matrix/blocks --blocked-----^
#include "matrices.hpp"
#include "transitions/catalogue.hpp"

using namespace edgewise;

constexpr JobTraits kMultiply{.name = "multiply", .target = "matrix/product"};
constexpr int kN = 512, kBlock = 64;
constexpr double kCube = double(kN) * kN * kN;

void backward(const float* a, const float* b, float* c) {  // gathers each value of C
    for (int i = 0; i < kN * kN; ++i) {
        float sum = 0;
        for (int k = 0; k < kN; ++k) sum += a[i / kN * kN + k] * b[k * kN + i % kN];
        c[i] = sum;
    }
}

void forward(const float* a, const float* b, float* c) {  // sends rows of B to rows of C
    std::fill_n(c, kN * kN, 0.f);
    for (int i = 0; i < kN * kN; ++i)
        for (int j = 0; j < kN; ++j) c[i / kN * kN + j] += a[i] * b[i % kN * kN + j];
}

void cut(const float* a, const float* b, float* blocks) {  // those of B, one below the other
    std::copy_n(a, kN * kN, blocks);
    for (int i = 0; i < kN * kN; i += kBlock)
        std::copy_n(b + i, kBlock, blocks + kN * kN + i % kN * kN + i / kN * kBlock);
}

void blocked(const float* a, const float* blocks, float* c) {
    std::fill_n(c, kN * kN, 0.f);
    for (int x = 0; x < kN; x += kBlock)
        for (int k = 0; k < kN; k += kBlock)
            for (int i = 0; i < kN * kBlock; i += 4) {  // a block of B stays near, A passes by
                const float* l = a + i / kBlock * kN + k + i % kBlock;
                const float* r = blocks + x * kN + (k + i % kBlock) * kBlock;
                for (int j = 0; j < kBlock; ++j)  // four rows of the block at once
                    c[i / kBlock * kN + x + j] += l[0] * r[j] + l[1] * r[kBlock + j] +
                                                  l[2] * r[2 * kBlock + j] +
                                                  l[3] * r[3 * kBlock + j];
            }
}

int main() {
    const Work gathered{.operations = 31 * kCube, .gathers = kCube};  // a sum waits: 30 in vectors
    const Work sent{.operations = 2 * kCube, .streamed = 4 * kCube};
    const Work joined{.operations = 2 * kCube, .streamed = 12 * kCube / kBlock};
    Catalogue edges = catalogue();
    edges.push_back(matrix_edge<float>(kN, "backward", "factors", "product", gathered, backward));
    edges.push_back(matrix_edge<float>(kN, "forward", "factors", "product", sent, forward));
    edges.push_back(
        matrix_edge<float>(kN, "cut", "factors", "blocks", {.streamed = 16 * kCube / kN}, cut));
    edges.push_back(matrix_edge<float>(kN, "blocked", "blocks", "product", joined, blocked));
    std::vector<Via> paths{{}, {"matrix.backward"}, {"matrix.forward"}, {"matrix.blocked"}};
    if (add_blas<float>(edges, kN)) paths.push_back({"matrix.blas"});
    MemoryBudget memory(std::size_t{64} << 20);
    const auto factors = data_of({"matrix", "factors", {kN, kN, 2}}, memory);
    std::vector<double> identity;
    for (int i = 0; i < kN * kN; ++i) {  // the cosine transform, which is orthogonal: A A^T = 1
        const int y = i / kN, x = i % kN;
        const double a = std::sqrt((y ? 2.0 : 1.0) / kN) * std::cos(M_PI * (x + 0.5) * y / kN);
        factors->as<float>()[i] = factors->as<float>()[kN * kN + x * kN + y] = float(a);
        identity.push_back(x == y);
    }
    // Products of rows of length 1 are off by N 2^-24 at most (Higham 2002, 3.5); factors round.
    return !are_right({edges, Job(kMultiply), factors, identity, (kN + 2) * 0x1p-24, memory},
                      paths);
}
