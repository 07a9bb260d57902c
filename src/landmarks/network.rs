//! The model's two graphs, run by rten on one thread.

use crate::LandmarkError;
use rten::{Model, ModelOptions, NodeId, OpRegistry, RunOptions, ThreadPool, op_types};
use rten_tensor::NdTensorView;
use std::sync::Arc;

/// Rows and columns of the detector's input.
pub(crate) const DETECTOR_PIXELS: usize = 224;
/// Rows and columns of the landmarks' input.
pub(crate) const LANDMARK_PIXELS: usize = 256;

/// Graphs of the person detector and of the landmarks.
pub(crate) struct LandmarkNetwork {
    model: Model,
    pool: Arc<ThreadPool>,
    detector: GraphTensors<2>,
    landmarks: GraphTensors<3>,
}

/// Tensors of one graph of the file.
struct GraphTensors<const N: usize> {
    name: &'static str,
    input: NodeId,
    outputs: [NodeId; N],
}

/// Numbers of the detector.
#[derive(Debug, Default)]
pub(crate) struct DetectorOutput {
    /// Twelve for each anchor: centre and size of the face's box, four points, columns before rows, pixels of the input.
    pub(crate) boxes: Vec<f32>,
    /// Logit of a person at each anchor.
    pub(crate) scores: Vec<f32>,
}

/// Numbers of the landmarks' graph.
#[derive(Debug, Default)]
pub(crate) struct LandmarkOutput {
    /// Five for each of 39 points: column, row and depth in pixels of the input, logits of visibility and of presence.
    pub(crate) screen: Vec<f32>,
    /// Probability of a person in the input.
    pub(crate) presence: f32,
    /// Three for each of 39 points: metres from the middle between the hips, x right, y down, z away from the camera.
    pub(crate) world: Vec<f32>,
}

impl LandmarkNetwork {
    /// Loads the content of the converted file.
    ///
    /// # Errors
    /// [`LandmarkError::Network`].
    pub(crate) fn load(content: Vec<u8>) -> Result<Self, LandmarkError> {
        let loaded = ModelOptions::with_ops(operators()).load(content);
        let model = loaded.map_err(|e| LandmarkError::network("file", e))?;
        Ok(Self {
            detector: GraphTensors::find(
                &model,
                "detector",
                "detector.image",
                ["detector.boxes", "detector.scores"],
            )?,
            landmarks: GraphTensors::find(
                &model,
                "landmarks",
                "landmarks.image",
                ["landmarks.screen", "landmarks.presence", "landmarks.world"],
            )?,
            model,
            pool: Arc::new(ThreadPool::with_num_threads(1)),
        })
    }

    /// Runs the detector on 224×224 pixels, channels first, −1 to 1.
    ///
    /// # Errors
    /// [`LandmarkError::Network`].
    pub(crate) fn detect(&self, image: &[f32]) -> Result<DetectorOutput, LandmarkError> {
        let [boxes, scores] = self.run(&self.detector, image, DETECTOR_PIXELS)?;
        Ok(DetectorOutput { boxes, scores })
    }

    /// Runs the landmarks' graph on 256×256 pixels, channels first, 0 to 1.
    ///
    /// # Errors
    /// [`LandmarkError::Network`].
    pub(crate) fn landmarks(&self, image: &[f32]) -> Result<LandmarkOutput, LandmarkError> {
        let [screen, presence, world] = self.run(&self.landmarks, image, LANDMARK_PIXELS)?;
        Ok(LandmarkOutput {
            screen,
            presence: presence.first().copied().unwrap_or(0.0),
            world,
        })
    }

    fn run<const N: usize>(
        &self,
        graph: &GraphTensors<N>,
        image: &[f32],
        pixels: usize,
    ) -> Result<[Vec<f32>; N], LandmarkError> {
        let fault = |why: &dyn std::fmt::Display| LandmarkError::network(graph.name, why);
        let input = NdTensorView::try_from_data([1, 3, pixels, pixels], image);
        let input = vec![(graph.input, input.map_err(|e| fault(&e))?.into())];
        let options = RunOptions::default().with_thread_pool(Some(self.pool.clone()));
        let outputs = self.model.run_n(input, graph.outputs, Some(options));
        let mut numbers = std::array::from_fn(|_| Vec::new());
        for (numbers, output) in numbers.iter_mut().zip(outputs.map_err(|e| fault(&e))?) {
            let tensor = output.into_tensor::<f32>();
            *numbers = tensor
                .ok_or_else(|| fault(&"numbers that are not f32"))?
                .into_data();
        }
        Ok(numbers)
    }
}

impl<const N: usize> GraphTensors<N> {
    fn find(
        model: &Model,
        name: &'static str,
        input: &str,
        outputs: [&str; N],
    ) -> Result<Self, LandmarkError> {
        let id =
            |tensor: &str| (model.node_id(tensor)).map_err(|e| LandmarkError::network(name, e));
        let input = id(input)?;
        let mut found = [input; N];
        for (found, tensor) in found.iter_mut().zip(outputs) {
            *found = id(tensor)?;
        }
        Ok(Self {
            name,
            input,
            outputs: found,
        })
    }
}

/// Operators of the two graphs: the others are left out of programs.
fn operators() -> OpRegistry {
    use op_types::*;
    OpRegistry::with_ops(&[
        &Add,
        &Clip,
        &Concat,
        &Conv,
        &DepthToSpace,
        &MaxPool,
        &Relu,
        &Reshape,
        &Resize,
        &Sigmoid,
        &Transpose,
    ])
}
