#include "block_grid_boxes.h"

namespace mp2p_icp
{
void BoxTree::build(const std::vector<ElementBox>& leaves)
{
    height_ = 0;
    root_ = ElementBox();
    if (leaves.empty()) return;
    std::vector<ElementBox> boxes = leaves;
    do
    {
        auto& groups = levels_[height_++];
        groups.assign((boxes.size() + BoxGroup::SIZE - 1) / BoxGroup::SIZE, BoxGroup());
        std::vector<ElementBox> around(groups.size());
        for (size_t b = 0; b < boxes.size(); b++)
        {
            groups[b / BoxGroup::SIZE].set(b % BoxGroup::SIZE, boxes[b]);
            around[b / BoxGroup::SIZE].add(boxes[b]);
        }
        boxes.swap(around);
    } while (boxes.size() > 1);
    root_ = boxes[0];
}

}  // namespace mp2p_icp
